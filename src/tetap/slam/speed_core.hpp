// SPDX-License-Identifier: Apache-2.0
// The core of a visual window that moves its pose by body speed and turn rate: wheels and a gyroscope.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/filter/big_covariance.hpp"
#include "tetap/slam/world_pose.hpp"

namespace tetap::slam {

/// Mean speed and turn rate of the body over an interval.
struct BodyMotion {
  nav::Vector3 speed_b_mps = nav::Vector3::Zero();
  nav::Vector3 rate_b_radps = nav::Vector3::Zero();
  float dt_s = 0;
  float var_way_m2 = 0, var_turn_rad2 = 0;  ///< per axis, beside that of SpeedNoise
};

struct SpeedNoise {
  float position_walk_m = 0.0316F;    ///< white noise of the speed, per axis and square root of a second
  float angle_walk_rad = 0.00316F;    ///< white noise of the turn rate, likewise
  float sigma_scale = 0.015F;         ///< speed; considered, never estimated
  float sigma_direction_rad = 0.03F;  ///< direction of the speed in the body, at the start
  float direction_walk_rad = 0.01F;   ///< per square root of a second
  [[nodiscard]] bool valid() const {
    const float sum = position_walk_m + angle_walk_rad + sigma_scale + sigma_direction_rad + direction_walk_rad;
    return position_walk_m >= 0.0F && angle_walk_rad >= 0.0F && sigma_scale >= 0.0F && sigma_direction_rad >= 0.0F &&
           direction_walk_rad >= 0.0F && base::is_finite(sum);
  }
};

/// A pose and three errors of the measured speed: its scale, its direction towards y and towards z. The true speed is
/// the measured one plus the forward speed times these three. Images cannot see the scale of a path apart from that of
/// the speed. The scale therefore is considered (Schmidt 1966): its variance counts, and no image moves it.
class SpeedCore {
 public:
  static constexpr int kErrors = 9, kConsidered = 6;
  using Motion = BodyMotion;

  explicit SpeedCore(const SpeedNoise& noise = {}) : noise_(noise) {}

  [[nodiscard]] const WorldPose& pose() const { return pose_; }
  [[nodiscard]] float direction_y_rad() const { return direction_y_rad_; }
  [[nodiscard]] float direction_z_rad() const { return direction_z_rad_; }

  [[nodiscard]] static bool valid(const BodyMotion& motion) {
    return nav::is_finite(motion.speed_b_mps) && nav::is_finite(motion.rate_b_radps) && motion.dt_s >= 0.0F &&
           motion.dt_s < 10.0F && motion.var_way_m2 >= 0.0F && motion.var_way_m2 < 1e6F &&
           motion.var_turn_rad2 >= 0.0F && motion.var_turn_rad2 < 1e3F;
  }
  void start(const nav::Quaternion& q_nb) {
    pose_ = {.q_nb = q_nb};
    direction_y_rad_ = direction_z_rad_ = 0.0F;
  }
  /// Variance of each error at the start; that of the pose is its user's.
  [[nodiscard]] float variance(int error) const {
    const float sigma = error == kConsidered ? noise_.sigma_scale : noise_.sigma_direction_rad;
    return sigma * sigma;
  }
  void place(const WorldPose& pose) { pose_ = pose; }
  void shift(const nav::Vector3& by_m) { pose_.p_n_m += by_m; }
  void correct(const float* error) {
    pose_.correct(error);
    direction_y_rad_ += error[7];
    direction_z_rad_ += error[8];
  }
  /// One interval: the pose, and the covariance of the errors from `first` on.
  template <class Covariance>
  void predict(const BodyMotion& motion, Covariance& p, int first) {
    const float dt_s = motion.dt_s, forward_mps = motion.speed_b_mps(0);
    const nav::Vector3 turn = motion.rate_b_radps * dt_s;
    const nav::Quaternion q_middle = pose_.q_nb * nav::exp_quaternion(0.5F * turn);
    const nav::Vector3 speed_b_mps =
        motion.speed_b_mps + nav::Vector3{0.0F, forward_mps * direction_y_rad_, forward_mps * direction_z_rad_};
    pose_.p_n_m += q_middle.rotate(speed_b_mps) * dt_s;
    pose_.q_nb = (pose_.q_nb * nav::exp_quaternion(turn)).renormalised();

    const nav::Matrix3 way = q_middle.matrix() * (forward_mps * dt_s);
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) p.add_share(first + 3 + i, way(i, j), first + 6 + j);
    // A turn of the body by n is theta = n and rho = p x n.
    const float var_turn = noise_.angle_walk_rad * noise_.angle_walk_rad * dt_s + motion.var_turn_rad2,
                var_way = noise_.position_walk_m * noise_.position_walk_m * dt_s + motion.var_way_m2,
                var_direction = noise_.direction_walk_rad * noise_.direction_walk_rad * dt_s;
    const nav::Matrix3 lever = nav::skew(pose_.p_n_m), lever2 = lever * lever.transpose();
    for (int i = 0; i < 3; ++i) {
      p(first + i, first + i) += var_turn;
      p(first + 3 + i, first + 3 + i) += var_way;
      for (int j = 0; j < 3; ++j) p(first + i, first + 3 + j) += var_turn * lever(j, i);
      for (int j = i; j < 3; ++j) p(first + 3 + i, first + 3 + j) += var_turn * lever2(i, j);
    }
    p(first + 7, first + 7) += var_direction;
    p(first + 8, first + 8) += var_direction;
  }
  static constexpr auto members(auto& self) {
    return base::members(base::unhashed(self.noise_), self.pose_, self.direction_y_rad_, self.direction_z_rad_);
  }

 private:
  SpeedNoise noise_;
  WorldPose pose_;
  float direction_y_rad_ = 0, direction_z_rad_ = 0;
};

}  // namespace tetap::slam
