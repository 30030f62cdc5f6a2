// SPDX-License-Identifier: Apache-2.0
// A simulated drive past a camera whose noise, and that of the speed and the gyroscope, the filter takes for given.
#pragma once

#include "slam/visual_drive.hpp"
#include "tetap/slam/speed_core.hpp"
#include "tetap/slam/visual_window.hpp"

#include <cmath>
#include <random>

namespace tetap::test {

struct NoisyDriveOptions {
  unsigned seed = 1;
  double step_s = 0.1, sigma_px = 1.5, start_yaw_rad = 0;
  slam::SpeedNoise noise;
  double sigma_mounting_rad = 0.003;
};

class NoisyDrive {
 public:
  [[nodiscard]] const Drive& drive() const { return drive_; }
  /// Options of a window that fit this world.
  [[nodiscard]] slam::VisualOptions options() const {
    return {.camera = drive_.camera,
            .mounting = drive_.mounting,
            .sigma_px = static_cast<float>(noisy_.sigma_px),
            .sigma_mounting_rad = static_cast<float>(noisy_.sigma_mounting_rad)};
  }

 protected:
  /// The camera looks ahead from `lever_b_m`, but for an error of its mounting.
  NoisyDrive(const NoisyDriveOptions& options, const model::PinholeCamera& camera, const nav::Vector3& lever_b_m)
      : noisy_(options), random_(options.seed) {
    drive_.camera = camera;
    Eigen::Matrix3d c;
    c << 0, -1, 0, 0, 0, -1, 1, 0, 0;
    drive_.mounting = {.q_cb = in_float(c), .lever_b_m = lever_b_m};
    drive_.means = true;
    true_c_ = rotation(normals() * noisy_.sigma_mounting_rad) * c;
    start_r_ = rotation({0, 0, noisy_.start_yaw_rad});
    error_ = {normal() * d(noisy_.noise.sigma_scale), normal() * d(noisy_.noise.sigma_direction_rad),
              normal() * d(noisy_.noise.sigma_direction_rad)};
  }
  double normal() { return normal_(random_); }
  double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }

  /// The image a step after `before`, and what the wheels and the gyroscope say of the way.
  void move(const DriveImage& before, DriveImage& image, double forward_mps, const Eigen::Vector3d& rate) {
    const double dt_s = noisy_.step_s, root = std::sqrt(dt_s);
    const Eigen::Vector3d speed(forward_mps, 0, 0);
    image.p_n_m = before.p_n_m + before.r_nb * rotation(rate * dt_s / 2) * speed * dt_s;
    image.r_nb = before.r_nb * rotation(rate * dt_s);
    const double measured = forward_mps / (1 + error_(0));
    image.speed_b_mps = speed - measured * error_ + normals() * (d(noisy_.noise.position_walk_m) / root);
    image.rate_b_radps = rate + normals() * (d(noisy_.noise.angle_walk_rad) / root);
    error_(1) += normal() * d(noisy_.noise.direction_walk_rad) * root;
    error_(2) += normal() * d(noisy_.noise.direction_walk_rad) * root;
  }

  NoisyDriveOptions noisy_;
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
  Drive drive_;
  Eigen::Matrix3d true_c_, start_r_;

 private:
  static double d(float v) { return static_cast<double>(v); }
  Eigen::Vector3d normals() {
    const double a = normal(), b = normal(), c = normal();
    return {a, b, c};
  }

  Eigen::Vector3d error_;
};

}  // namespace tetap::test
