// SPDX-License-Identifier: Apache-2.0
// A map of points moves with the robot that is put elsewhere. What is known of the points as seen from the robot stays;
// the error of the robot's old pose leaves them, and that of the new one takes its place.
#pragma once

#include "tetap/filter/big_covariance.hpp"
#include "tetap/slam/point_map.hpp"
#include "tetap/slam/world_pose.hpp"

namespace tetap::slam {

/// Sigmas of a pose along the world's axes.
struct PoseSigmas {
  nav::Vector3 attitude_rad = nav::Vector3::Zero(), place_m = nav::Vector3::Zero();
};

/// `pose` is the first of six states of the pose, `first` that of the first point. States from `gone` to `first` - 1,
/// earlier poses, are independent and certain afterwards.
template <class Covariance, class Map>
void move_map(Covariance& p, Map& map, int pose, int gone, int first, const WorldPose& from, const WorldPose& to,
              const PoseSigmas& sigmas) {
  // f = Exp(theta) f^ + rho for the world's error of the pose: its part of the point's error.
  const auto share = [&](int point, const nav::Vector3& at, float sign) {
    for (int i = 0; i < 3; ++i) {
      const int state = first + 3 * point + i, j = (i + 1) % 3, k = (i + 2) % 3;
      p.add_share(state, sign, pose + 3 + i);
      p.add_share(state, sign * at(k), pose + j);
      p.add_share(state, -sign * at(j), pose + k);
    }
  };
  for (int m = 0; m < map.size(); ++m) share(m, map[m].first_n_m, -1.0F);
  const auto forget = [&](int state, float variance) {
    for (int n = 0; n < p.size(); ++n) p(n, state) = 0.0F;
    p(state, state) = variance;
  };
  for (int i = 0; i < 3; ++i) {
    forget(pose + i, sigmas.attitude_rad(i) * sigmas.attitude_rad(i));
    forget(pose + 3 + i, sigmas.place_m(i) * sigmas.place_m(i));
  }
  for (int state = gone; state < first; ++state) forget(state, 0.0F);
  const nav::Matrix3 turn = (to.q_nb * from.q_nb.conjugate()).matrix();
  for (int m = 0; m < map.size(); ++m) {
    const int at = first + 3 * m;
    nav::Matrix3 own;
    for (int n = 0; n < p.size(); ++n) {
      const nav::Vector3 turned = turn * nav::Vector3{p(n, at), p(n, at + 1), p(n, at + 2)};
      if (n >= at && n < at + 3) {
        own.row(n - at) = turned.transpose();
        continue;
      }
      for (int i = 0; i < 3; ++i) p(n, at + i) = turned(i);
    }
    const nav::Matrix3 block = turn * own;
    for (int c = 0; c < 3; ++c)
      for (int r = 0; r <= c; ++r) p(at + r, at + c) = block(r, c);
    map[m].at_n_m = map[m].first_n_m = to.p_n_m + turn * (map[m].at_n_m - from.p_n_m);
    share(m, map[m].at_n_m, 1.0F);
  }
}

}  // namespace tetap::slam
