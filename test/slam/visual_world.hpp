// SPDX-License-Identifier: Apache-2.0
// A simulated road between points on both sides, seen by a camera whose noise is that which the filter takes for given.
#pragma once

#include "slam/noisy_drive.hpp"

namespace tetap::test {

struct VisualWorldOptions {
  unsigned seed = 1;
  int images = 150;
  double step_s = 0.1, sigma_px = 1.5;
  double sway_m = 0;  ///< instead of driving: this far forth and back along x, without turning
  double start_yaw_rad = 0;
  Eigen::Vector3d start_n_m = Eigen::Vector3d::Zero();
  slam::SpeedNoise noise;
  double sigma_mounting_rad = 0.003;
  double moving_share = 0;  ///< share of points on one body that drives along
  Eigen::Vector3d moving_mps{6, 0.5, 0};
};

class VisualWorld : public NoisyDrive {
 public:
  explicit VisualWorld(const VisualWorldOptions& options)
      : NoisyDrive({.seed = options.seed,
                    .step_s = options.step_s,
                    .sigma_px = options.sigma_px,
                    .start_yaw_rad = options.start_yaw_rad,
                    .noise = options.noise,
                    .sigma_mounting_rad = options.sigma_mounting_rad},
                   {.fu_px = 720, .fv_px = 720, .cu_px = 610, .cv_px = 185}, {1.0F, 0.2F, 0.7F}),
        o_(options) {
    for (int k = 0; k < o_.images; ++k) add_image(k);
  }

 private:
  struct Point {
    Eigen::Vector3d at;
    std::uint16_t id = 0;
    bool moves = false;
  };

  void add_image(int k) {
    DriveImage image;
    image.time_s = 1.0 + k * o_.step_s;
    if (k == 0) {
      image.r_nb = start_r_;
      image.p_n_m = o_.start_n_m;
    } else {
      drive_on(drive_.images.back(), image, k * o_.step_s);
    }
    see(image);
    drive_.images.push_back(image);
  }
  void drive_on(const DriveImage& before, DriveImage& image, double t_s) {
    const bool sways = o_.sway_m > 0;
    const Eigen::Vector3d rate =
        sways ? Eigen::Vector3d(0, 0, 0)
              : Eigen::Vector3d(0.02 * std::sin(1.1 * t_s), 0.02 * std::sin(0.9 * t_s + 1), 0.2 * std::sin(0.35 * t_s));
    move(before, image, sways ? 3 * o_.sway_m * std::cos(3 * t_s) : 8 + 2 * std::sin(0.3 * t_s), rate);
  }
  /// Points stay tracked while they are seen; new ones are made up where room for 40 is left.
  void see(DriveImage& image) {
    std::vector<Point> kept;
    for (Point& point : points_) {
      if (point.moves) point.at += start_r_ * o_.moving_mps * o_.step_s;
      if (show(point, image)) kept.push_back(point);
    }
    points_ = kept;
    for (int tries = 0; points_.size() < 40 && tries < 400; ++tries) {
      Point point;
      const double ahead = uniform(6, 45), side = uniform(-0.7, 0.7) * ahead, up = uniform(-0.2, 0.2) * ahead;
      point.at = image.p_n_m + image.r_nb * Eigen::Vector3d(ahead, side, up);
      point.moves = uniform(0, 1) < o_.moving_share;
      point.id = static_cast<std::uint16_t>(next_id_ % 4096);
      if (!show(point, image)) continue;
      ++next_id_;
      points_.push_back(point);
    }
  }
  bool show(const Point& point, DriveImage& image) {
    const Eigen::Vector3d lever = in_double(drive_.mounting.lever_b_m);
    const Eigen::Vector3d l = true_c_ * (image.r_nb.transpose() * (point.at - image.p_n_m) - lever);
    if (l(2) < 2 || l(2) > 60) return false;
    const double u = 720 * l(0) / l(2) + 610, v = 720 * l(1) / l(2) + 185;
    if (u < 10 || u > 1230 || v < 10 || v > 365) return false;
    const double u_px = u + normal() * o_.sigma_px, v_px = v + normal() * o_.sigma_px;
    if (u_px < 0 || v_px < 0) return false;
    image.features.push_back({point.id, static_cast<std::uint16_t>(std::lround(4 * u_px)),
                              static_cast<std::uint16_t>(std::lround(4 * v_px))});
    return true;
  }

  VisualWorldOptions o_;
  std::vector<Point> points_;
  unsigned next_id_ = 0;
};

}  // namespace tetap::test
