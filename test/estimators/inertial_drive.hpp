// SPDX-License-Identifier: Apache-2.0
// A rover drives on a flat plane for the inertial estimator alone. Its IMU is as noisy as the estimator's parameters
// state, its wheels are exact, its receiver errs as stated. Errors are judged against the estimator's own uncertainty.
#pragma once

#include "tetap/estimators/inertial/inertial.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <random>
#include <string>
#include <utility>

namespace tetap::estimators {

inline constexpr double kMetre_2ndeg =
    1 / (2e-9 * 111'320);  ///< steps in a metre of latitude, near enough for a few hundred metres

inline param::Parameters parameters() {
  param::Parameters n;
  n.wheels.drive = {.left_radius_m = 0.1F, .right_radius_m = 0.1F, .track_m = 0.5F, .counts_per_turn = 20'000};
  n.inertial.gyro_radps_rthz = 2e-4F;
  n.inertial.accel_mps2_rthz = 5e-3F;
  n.inertial.slip_share = 0.05F;
  n.gnss.sigma_floor_m = 0.01F;
  return n;
}

inline param::Parameters rover_like() {
  param::Parameters n = parameters();
  n.inertial.gyro_radps_rthz = 2e-3F;
  n.inertial.accel_mps2_rthz = 2e-2F;
  n.inertial.slip_share = 0.02F;
  n.inertial.constrain_every_us = 20'000;
  n.gnss.sigma_floor_m = 0.3F;
  n.gnss.correlation_s = 60;
  return n;
}

template <class Estimator>
class DriveOf {
 public:
  explicit DriveOf(const param::Parameters& of = parameters(), unsigned seed = 1)
      : n(of), engine_(seed), engine_imu_(98 + seed) {
    map_frame.frame = nav::LocalFrame(24'131'350'000, 5'834'150'000, 500.0F);
    map_frame.origin = sensor::OriginSource::kConfigured;
    gravity_mps2_ = nav::Earth::at(map_frame.frame, false).gravity_mps2;
    estimator.restart({us}, ctx());
  }
  /// Somebody says where it is.
  void place(double off_m = 0, float sigma_m = 0.1F, float sigma_yaw_rad = 0.02F) {
    estimator.set_pose({us},
                       {.pose = {.x = base::Anchored{}.plus(static_cast<float>(east_m + off_m)),
                                 .y = base::Anchored{}.plus(static_cast<float>(north_m)),
                                 .yaw_rad = static_cast<float>(yaw_rad)},
                        .sigma_position_m = sigma_m,
                        .sigma_yaw_rad = sigma_yaw_rad},
                       ctx());
  }

  param::Parameters n;
  MapFrame map_frame;
  Estimator estimator;
  double east_m = 0, north_m = 0, up_m = 0, yaw_rad = 0.3, speed_mps = 1, turn_radps = 0.05;
  double unseen_east_m = 0;  ///< the rover is carried, and no sensor of motion shows it
  double white_m = 1, lasting_m = 0, lasting_s = 60;
  double stated_ratio = 1;     ///< the receiver's own accuracy figure, in what it is
  double gyro_bias_radps = 0;  ///< about the vertical
  double left_slip_mps = 0;    ///< the left wheel is so much faster than the ground below it
  std::int64_t gnss_every_us = 200'000, speedometer_every_us = 10'000;
  bool wheels = true, speedometer = false, gnss_velocity = true;
  bool silent = false;  ///< the rover drives on, and no sensor's samples come
  /// Effect of the world on a fix; false: it does not come.
  struct Fix {
    double east_m = 0, north_m = 0, up_m = 0;
    float east_off_mps = 0;  ///< error of the velocity that comes with it
    bool repeated = false;   ///< the last one again
  };
  std::function<bool(Fix&)> tamper = [](Fix&) { return true; };

  std::function<void(sensor::ImuSample&)> tamper_imu = [](sensor::ImuSample&) {};
  std::function<void(sensor::WheelCounts&)> tamper_wheels = [](sensor::WheelCounts&) {};

  std::string verdicts;  ///< verdicts of positions, one letter each
  Innovation last_fix, last_velocity, last_imu;
  double worst_m = 0;       ///< error since clear()
  double worst_sigmas = 0;  ///< the same in the estimator's own sigma
  double nees = 0;          ///< sum of the horizontal ones, and how many
  int judged = 0;

  [[nodiscard]] Context ctx() const { return {n, map_frame}; }
  [[nodiscard]] double time_s() const { return 1e-6 * static_cast<double>(us - kBegin_us); }
  [[nodiscard]] double error_m() const {
    const auto& x = now_.state;
    return std::hypot(off(x.x, east_m), off(x.y, north_m));
  }
  [[nodiscard]] double apart_m(const DriveOf& other) const {
    return std::hypot(static_cast<double>(now_.state.x.minus(other.now_.state.x)),
                      static_cast<double>(now_.state.y.minus(other.now_.state.y)));
  }
  [[nodiscard]] double height_error_m() const { return std::abs(off(now_.state.z, up_m)); }
  [[nodiscard]] double height_sigma_m() const { return std::sqrt(static_cast<double>(now_.p(2, 2))); }
  [[nodiscard]] double sigma_yaw_rad() const { return std::sqrt(static_cast<double>(now_.p(8, 8))); }
  [[nodiscard]] double yaw_error_rad() const {
    return std::abs(
        std::remainder(static_cast<double>(nav::euler(now_.state.q_nb).yaw_rad) - yaw_rad, 2 * 3.14159265358979));
  }
  [[nodiscard]] double sigma_m() const { return std::sqrt(static_cast<double>(now_.p(0, 0) + now_.p(1, 1)) / 2); }
  [[nodiscard]] bool tracking() const { return now_.valid; }
  [[nodiscard]] long counted(char verdict) const { return std::count(verdicts.begin(), verdicts.end(), verdict); }
  void clear() {
    worst_m = worst_sigmas = nees = 0;
    judged = 0;
    verdicts.clear();
  }
  void run(double duration_s) {
    for (const std::int64_t end = us + std::llround(duration_s * 1e6); us < end;) step();
  }
  static constexpr std::int64_t kBegin_us = 1'000'000, kStep_us = 10'000;
  std::int64_t us = kBegin_us;

 private:
  static double off(const base::Anchored& of, double truth_m) { return 1e-6 * static_cast<double>(of.um()) - truth_m; }
  double normal() { return normal_(engine_); }

  void step() {
    constexpr double dt = 1e-6 * kStep_us;
    us += kStep_us;
    yaw_rad += turn_radps * dt;
    const double middle = yaw_rad - 0.5 * turn_radps * dt;
    east_m += speed_mps * std::cos(middle) * dt + std::exchange(unseen_east_m, 0);
    north_m += speed_mps * std::sin(middle) * dt;
    const auto shake = [this](double sigma) { return static_cast<float>(sigma * normal_imu_(engine_imu_)); };
    const double pushed = time_s() < 0.015 ? 0 : speed_mps - last_mps_;
    last_mps_ = speed_mps;
    sensor::ImuSample imu{.dangle_b_rad = {shake(2e-5), shake(2e-5),
                                           static_cast<float>((turn_radps + gyro_bias_radps) * dt) + shake(2e-5)},
                          .dvelocity_b_mps = {static_cast<float>(pushed) + shake(5e-4),
                                              static_cast<float>(speed_mps * turn_radps * dt) + shake(5e-4),
                                              gravity_mps2_ * static_cast<float>(dt) + shake(5e-4)},
                          .interval_us = kStep_us};
    tamper_imu(imu);
    if (!silent) last_imu = estimator.fuse(imu, {us}, ctx());
    if (wheels) {
      const double per_m = 20'000 / (2 * 3.14159265358979 * 0.1);
      left_ += (speed_mps - 0.25 * turn_radps + left_slip_mps) * dt * per_m;
      right_ += (speed_mps + 0.25 * turn_radps) * dt * per_m;
      sensor::WheelCounts counts{static_cast<std::uint16_t>(std::llround(left_)),
                                 static_cast<std::uint16_t>(std::llround(right_))};
      tamper_wheels(counts);
      if (!silent) estimator.fuse(counts, {us}, ctx());
    }
    if (!silent && speedometer && (us - kBegin_us) % speedometer_every_us == 0)
      estimator.fuse(sensor::BodySpeed{.forward_mps = static_cast<float>(speed_mps)}, {us}, ctx());
    if (!silent && (us - kBegin_us) % gnss_every_us == 0) receive();
    estimator.advance({us}, ctx(), {});
    const InertialEstimate now = estimator.inertial(ctx());
    now_ = {.state = now.state, .p = now.p, .valid = now.valid};
    if (!now_.valid) return;
    worst_m = std::max(worst_m, error_m());
    worst_sigmas = std::max(worst_sigmas, error_m() / sigma_m());
    const double e = off(now_.state.x, east_m), m = off(now_.state.y, north_m);
    const auto p = [this](int r, int c) { return static_cast<double>(now_.p(r, c)); };
    const double determinant = p(0, 0) * p(1, 1) - p(0, 1) * p(0, 1);
    nees += (e * e * p(1, 1) - 2 * e * m * p(0, 1) + m * m * p(0, 0)) / determinant;
    ++judged;
  }
  void receive() {
    const double keep = std::exp(-1e-6 * static_cast<double>(gnss_every_us) / lasting_s);
    const double ahead_m = static_cast<double>(n.gnss.antenna_x_b_m), sideways_mps = turn_radps * ahead_m;
    Fix fix{
        .east_m = east_m + ahead_m * std::cos(yaw_rad), .north_m = north_m + ahead_m * std::sin(yaw_rad), .up_m = up_m};
    const std::array<double*, 3> axes{&fix.east_m, &fix.north_m, &fix.up_m};
    for (std::size_t i = 0; i < 3; ++i) {
      double& lasts = lasting_[i];
      lasts = begun_ ? keep * lasts + std::sqrt(1 - keep * keep) * normal() : normal();
      *axes[i] += (i == 2 ? 1.5 : 1.0) * (white_m * normal() + lasting_m * lasts);
    }
    begun_ = true;
    const auto noise = [this] { return static_cast<float>(0.05 * normal()); };
    const double east_mps = speed_mps * std::cos(yaw_rad) - sideways_mps * std::sin(yaw_rad);
    const double north_mps = speed_mps * std::sin(yaw_rad) + sideways_mps * std::cos(yaw_rad);
    sensor::GnssVelocity velocity{
        .v_n_mps = {static_cast<float>(east_mps) + noise(), static_cast<float>(north_mps) + noise(), noise()},
        .acc_mps = 0.05F};
    if (!tamper(fix)) return;
    velocity.v_n_mps[0] += fix.east_off_mps;
    const double cosine = std::cos(24'131'350'000 * 2e-9 * 3.14159265358979 / 180);
    const auto sigma = static_cast<float>(stated_ratio * std::hypot(white_m, lasting_m));
    if (!fix.repeated) {
      report_ = {.latitude_2ndeg = 24'131'350'000 + std::llround(fix.north_m * kMetre_2ndeg),
                 .longitude_2ndeg = 5'834'150'000 + std::llround(fix.east_m * kMetre_2ndeg / cosine),
                 .height_m = static_cast<float>(500 + fix.up_m),
                 .horizontal_acc_m = sigma,
                 .vertical_acc_m = 1.5F * sigma,
                 .fix = sensor::GnssFix::k3d};
      velocity_report_ = velocity;
    }
    last_fix = estimator.fuse(report_, {us}, ctx());
    verdicts += "aRnTUSFs"[static_cast<std::size_t>(last_fix.verdict)];
    if (gnss_velocity) last_velocity = estimator.fuse(velocity_report_, {us}, ctx());
  }

  std::mt19937 engine_;
  std::normal_distribution<double> normal_;
  std::mt19937 engine_imu_;  ///< noise of the IMU: an exact one would be a stuck one
  std::normal_distribution<double> normal_imu_;
  float gravity_mps2_ = 0;
  double left_ = 0, right_ = 0, last_mps_ = 1;
  std::array<double, 3> lasting_{};
  bool begun_ = false;
  sensor::GnssPosition report_;
  sensor::GnssVelocity velocity_report_;
  struct {
    nav::InsState state;
    nav::Ins::Covariance p;
    bool valid = false;
  } now_;
};
using Drive = DriveOf<Inertial>;

/// 3 sigma of some of the errors, as one length.
inline double three_sigma(const InertialEstimate& of, std::initializer_list<int> errors) {
  double variance = 0;
  for (const int k : errors) variance += static_cast<double>(of.p(k, k));
  return 3 * std::sqrt(variance);
}

/// A drive that has found itself.
template <class Estimator = Inertial>
DriveOf<Estimator> settled(const param::Parameters& of = parameters(), unsigned seed = 1) {
  DriveOf<Estimator> d(of, seed);
  d.place();
  d.run(60);
  EXPECT_TRUE(d.tracking());
  EXPECT_LT(d.error_m(), 1.0);
  d.clear();
  return d;
}

}  // namespace tetap::estimators
