// SPDX-License-Identifier: Apache-2.0
// A simulated flight in a room, from rest: formulas for the path, their numeric derivatives for the inertial sensor,
// and noise, biases, mounting and time offset with the sigmas that the filter takes for given.
#pragma once

#include "slam/inertial_drive.hpp"

#include <random>

namespace tetap::test {

struct InertialWorldOptions {
  unsigned seed = 1;
  double end_s = 40, rest_s = 3, sigma_px = 1, turn_rad = 0;
  double reach = 1;  ///< share of the motion: 0 rests for ever
  Eigen::Vector3d at_n_m = Eigen::Vector3d::Zero();
  slam::InertialSetup setup;
  double sigma_mounting_rad = 0.003;
  double room_m = 4;  ///< half its width
};

class InertialWorld {
 public:
  explicit InertialWorld(const InertialWorldOptions& o) : o_(o), random_(o.seed), turn_(rotation({0, 0, o.turn_rad})) {
    Eigen::Matrix3d c;
    c << 0, -1, 0, 0, 0, -1, 1, 0, 0;
    drive_.camera.camera = {.fu_px = 460, .fv_px = 460, .cu_px = 376, .cv_px = 240};
    drive_.camera.mounting = {.q_cb = in_float(c), .lever_b_m = {0.05F, -0.02F, 0.03F}};
    true_c_ = rotation(normals(o.sigma_mounting_rad)) * c;
    drive_.offset_s = d(o.setup.time_offset_s) + normal() * d(o.setup.sigma_time_offset_s);
    for (int i = 0; i < 900; ++i) add_point(i % 3, i % 2 == 0);
    measure();
    for (double t = 0.1; t < o.end_s; t += 0.1) see(std::round(t * 10) / 10);
    drive_.recognised.resize(drive_.camera.images.size());
  }
  [[nodiscard]] const InertialDrive& drive() const { return drive_; }
  [[nodiscard]] slam::VisualOptions options() const {
    return {.camera = drive_.camera.camera,
            .mounting = drive_.camera.mounting,
            .sigma_px = static_cast<float>(o_.sigma_px),
            .sigma_mounting_rad = static_cast<float>(o_.sigma_mounting_rad)};
  }

 private:
  struct Point {
    Eigen::Vector3d at;
    int track = -1, seen = 0;
  };
  static double d(float v) { return static_cast<double>(v); }
  double normal() { return normal_(random_); }
  Eigen::Vector3d normals(double sigma) {
    const double a = normal(), b = normal(), c = normal();
    return sigma * Eigen::Vector3d(a, b, c);
  }
  double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
  /// How much of the motion has begun.
  [[nodiscard]] double share(double t) const {
    const double x = std::clamp((t - o_.rest_s) / 2, 0.0, 1.0);
    return o_.reach * x * x * x * (10 - 15 * x + 6 * x * x);
  }
  [[nodiscard]] Eigen::Vector3d place(double t) const {
    const double s = share(t);
    const Eigen::Vector3d sway(1.4 * std::sin(0.5 * t), 1.4 * std::sin(0.37 * t + 1), 0.5 * std::sin(0.8 * t));
    return o_.at_n_m + turn_ * (s * sway);
  }
  [[nodiscard]] Eigen::Matrix3d attitude(double t) const {
    const double s = share(t);
    return turn_ * rotation({0, 0, s * (0.25 * t + 0.4 * std::sin(0.6 * t))}) *
           rotation({0, s * 0.15 * std::sin(0.9 * t), 0}) * rotation({s * 0.2 * std::sin(0.7 * t + 2), 0, 0});
  }
  void measure() {
    constexpr double kStep_s = 0.005, kH_s = 1e-3;
    const auto& n = o_.setup.noise;
    const double root = std::sqrt(kStep_s);
    Eigen::Vector3d of_gyro = normals(0.02), of_force = normals(d(o_.setup.sigma_accel_bias_mps2));
    for (int k = 0; k * kStep_s < o_.end_s + 0.2; ++k) {
      const double t = k * kStep_s;
      const Eigen::Matrix3d r = attitude(t);
      const Eigen::Vector3d rate = rotation_vector(attitude(t - kH_s).transpose() * attitude(t + kH_s)) / (2 * kH_s);
      const Eigen::Vector3d a = (place(t + kH_s) - 2 * place(t) + place(t - kH_s)) / (kH_s * kH_s) +
                                Eigen::Vector3d(0, 0, d(o_.setup.earth.gravity_mps2));
      drive_.imu.push_back({std::llround(t * 1e6), rate + of_gyro + normals(d(n.gyro_radps_rthz) / root),
                            r.transpose() * a + of_force + normals(d(n.accel_mps2_rthz) / root)});
      of_gyro += normals(d(n.gyro_bias_radps2_rthz) * root);
      of_force += normals(d(n.accel_bias_mps3_rthz) * root);
    }
  }
  void add_point(int axis, bool high) {
    const double x = uniform(-1, 1), y = uniform(-1, 1), z = uniform(-1, 1);
    Eigen::Vector3d p(x, y, z);
    p(axis) = high ? 1 : -1;
    points_.push_back({.at = o_.at_n_m + turn_ * (o_.room_m * p)});
  }
  void see(double t) {
    DriveImage image;
    image.time_s = t;
    image.r_nb = attitude(t);
    image.p_n_m = place(t);
    drive_.v_n_mps.push_back((place(t + 1e-4) - place(t - 1e-4)) / 2e-4);
    std::vector<std::pair<Point*, Eigen::Vector2d>> fresh;
    for (Point& point : points_) {
      const Eigen::Vector3d l =
          true_c_ * (image.r_nb.transpose() * (point.at - image.p_n_m) - in_double(drive_.camera.mounting.lever_b_m));
      const Eigen::Vector2d at(460 * l(0) / l(2) + 376, 460 * l(1) / l(2) + 240);
      const bool inside = l(2) > 0.5 && at(0) > 5 && at(0) < 747 && at(1) > 5 && at(1) < 475;
      if (!inside || ++point.seen > 20) {
        point.track = -1;
      } else if (point.track >= 0) {
        show(point, at, image);
        continue;
      }
      if (inside) fresh.emplace_back(&point, at);
    }
    std::shuffle(fresh.begin(), fresh.end(), random_);
    for (const auto& [point, at] : fresh) {
      if (image.features.size() >= 40) break;
      point->track = next_id_++ % 4096;
      point->seen = std::uniform_int_distribution<int>(1, 10)(random_);  // lives of 1 to 2 s
      show(*point, at, image);
    }
    drive_.camera.images.push_back(image);
  }
  void show(const Point& point, const Eigen::Vector2d& at, DriveImage& image) {
    const auto quarter = [&](double px) {
      return static_cast<std::uint16_t>(std::lround(4 * std::max(0.0, px + normal() * o_.sigma_px)));
    };
    const auto u = quarter(at(0)), v = quarter(at(1));
    image.features.push_back({static_cast<std::uint16_t>(point.track), u, v});
  }

  InertialWorldOptions o_;
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
  Eigen::Matrix3d turn_, true_c_;
  std::vector<Point> points_;
  int next_id_ = 0;
  InertialDrive drive_;
};

}  // namespace tetap::test
