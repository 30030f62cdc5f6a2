// SPDX-License-Identifier: Apache-2.0
// The direction in which a camera sees a point of the world, and its rows of H. A turn and a shift of the world that
// take poses and point along are invisible to these rows at any linearisation point.
#pragma once

#include "tetap/model/camera.hpp"
#include "tetap/slam/world_pose.hpp"

#include <array>

namespace tetap::slam {

/// With l the point in the camera's axes, J = d(direction)/dl and A = J C R^T: rows -J [l]x of the camera's rotation,
/// A [f]x and -A of the pose's theta and rho, A of the point f.
struct PointSighting {
  model::Projection at;
  std::array<std::array<float, 9>, 2> h{};  ///< camera's rotation, theta, rho
  std::array<std::array<float, 3>, 2> of_point{};

  PointSighting(const WorldPose& pose, const model::CameraMounting& camera, const nav::Vector3& point_n_m)
      : PointSighting(camera.to_camera(pose.q_nb.conjugate().rotate(point_n_m - pose.p_n_m)),
                      (camera.q_cb * pose.q_nb.conjugate()).matrix(), point_n_m) {}

 private:
  PointSighting(const nav::Vector3& point_c_m, const nav::Matrix3& r_cn, const nav::Vector3& point_n_m)
      : at(point_c_m) {
    for (int i = 0; i < 2; ++i) {
      const nav::Vector3 j = at.h.row(i).transpose(), a = r_cn.transpose() * j;
      const nav::Vector3 of_camera = nav::cross(point_c_m, j), of_turn = nav::cross(a, point_n_m);
      auto& row = h[static_cast<std::size_t>(i)];
      for (int n = 0; n < 3; ++n) {
        const auto k = static_cast<std::size_t>(n);
        row[k] = of_camera(n);
        row[3 + k] = of_turn(n);
        row[6 + k] = -a(n);
        of_point[static_cast<std::size_t>(i)][k] = a(n);
      }
    }
  }
};

}  // namespace tetap::slam
