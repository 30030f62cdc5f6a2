// SPDX-License-Identifier: Apache-2.0
#include "sim_host/doctor/window.hpp"

#include "tetap/model/differential_drive.hpp"

#include <cmath>
#include <numbers>

namespace tetap::doctor {
namespace {

constexpr std::int64_t kWindow_us = 1'000'000;
constexpr double kWindowGap_s = 0.5;  ///< a longer pause of IMU or wheels is a hole, over which no rate is taken
constexpr double kCovered_s = 0.5;    ///< less of a second with data is no mean of it

Vector3 wide(const std::array<float, 3>& x) {
  return {static_cast<double>(x[0]), static_cast<double>(x[1]), static_cast<double>(x[2])};
}
double span_s(base::Micros span) { return static_cast<double>(span.us) * 1e-6; }

}  // namespace

WheelScale wheel_scale(const RobotFacts& robot) {
  const param::WheelParameters& n = robot.parameters.wheels;
  WheelScale scale{.speed = static_cast<double>(n.speed_scale),
                   .yaw_rate = static_cast<double>(n.yaw_rate_scale),
                   .left_speed = static_cast<double>(n.left_speed_scale),
                   .right_speed = static_cast<double>(n.right_speed_scale)};
  if (robot.name.empty() || n.drive.left_radius_m <= 0) return scale;
  const double turn = 2 * std::numbers::pi / static_cast<double>(n.drive.counts_per_turn);
  scale.left_m = turn * static_cast<double>(n.drive.left_radius_m);
  scale.right_m = turn * static_cast<double>(n.drive.right_radius_m);
  scale.track_m = static_cast<double>(n.drive.track_m);
  scale.known = true;
  return scale;
}

std::optional<Window> Windows::add(base::Micros time, const sensor::Sample& sample) {
  std::optional<Window> done;
  if (!begun_ || time.us < start_us_ || time.us >= start_us_ + kWindow_us) {
    if (begun_) done = finished();
    start_us_ = time.us - ((time.us % kWindow_us) + kWindow_us) % kWindow_us;
    begun_ = true;
  }
  switch (sample.sensor) {
    case sensor::Sensor::kImu:
      if (sample.instance == imu_) add_imu(time, sample.payload.imu);
      break;
    case sensor::Sensor::kWheelCounts:
    case sensor::Sensor::kWheelSpeed:
    case sensor::Sensor::kBodySpeed:
      if (sample.instance == 0) add_wheels(time, sample);
      break;
    case sensor::Sensor::kGnssVelocity:
      if (sample.instance == 0) velocity_.add(wide(sample.payload.gnss_velocity.v_n_mps));
      break;
    case sensor::Sensor::kMagnetometer:
      if (sample.instance == 0) flux_.add(wide(sample.payload.magnetic.flux_b_uT));
      break;
    default:
      break;
  }
  return done;
}

void Windows::add_imu(base::Micros time, const sensor::ImuSample& imu) {
  const double dt_s = imu_last_ ? span_s(time - *imu_last_) : -1;
  imu_last_ = time;
  if (dt_s < 0 || dt_s > kWindowGap_s) return;
  turn_rad_ = sum(turn_rad_, wide(imu.dangle_b_rad));
  velocity_change_mps_ = sum(velocity_change_mps_, wide(imu.dvelocity_b_mps));
  imu_s_ += dt_s;
  intervals_s_ += 1e-6 * imu.interval_us;
}

void Windows::add_speeds(double dt_s, double left_mps, double right_mps) {
  wheels_s_ += dt_s;
  wheel_sum_m_ += dt_s * (left_mps + right_mps);
  wheel_difference_m_ += dt_s * (right_mps - left_mps);
  has_difference_ = true;
}

void Windows::add_wheels(base::Micros time, const sensor::Sample& sample) {
  const double dt_s = wheels_last_ ? span_s(time - *wheels_last_) : -1;
  wheels_last_ = time;
  const bool usable = dt_s >= 0 && dt_s <= kWindowGap_s;
  if (sample.sensor == sensor::Sensor::kWheelCounts) {
    const sensor::WheelCounts now = sample.payload.counts;
    if (usable && counts_last_) {
      const double left = scale_.left_m * model::count_difference(now.left, counts_last_->left);
      const double right = scale_.right_m * model::count_difference(now.right, counts_last_->right);
      wheels_s_ += dt_s, wheel_sum_m_ += left + right, wheel_difference_m_ += right - left;
      has_difference_ = true;
    }
    counts_last_ = now;
  } else if (usable && sample.sensor == sensor::Sensor::kWheelSpeed) {
    add_speeds(dt_s, scale_.left_speed * static_cast<double>(sample.payload.wheel_speeds.left_mps),
               scale_.right_speed * static_cast<double>(sample.payload.wheel_speeds.right_mps));
  } else if (usable) {
    const double forward = scale_.speed * static_cast<double>(sample.payload.body_speed.forward_mps);
    const double yaw_rate = scale_.yaw_rate * static_cast<double>(sample.payload.body_speed.yaw_rate_radps);
    wheels_s_ += dt_s;
    wheel_sum_m_ += dt_s * 2 * forward;
    if (std::isfinite(yaw_rate)) wheel_difference_m_ += dt_s * yaw_rate * scale_.track_m, has_difference_ = true;
  }
}

Window Windows::finished() {
  Window w{.start_s = static_cast<double>(start_us_) * 1e-6,
           .turn_s_radps = {},
           .force_s_mps2 = {},
           .wheels = {},
           .velocity_n_mps = velocity_.mean(),
           .flux_s_uT = flux_.mean()};
  if (imu_s_ > kCovered_s) {
    w.turn_s_radps = scaled(1 / imu_s_, turn_rad_);
    w.force_s_mps2 = scaled(1 / imu_s_, velocity_change_mps_);
    force_sum_ = sum(force_sum_, *w.force_s_mps2);
    up_s_ = unit(force_sum_);
    w.imu_share = intervals_s_ / imu_s_;
  }
  if (wheels_s_ > kCovered_s) {
    w.wheels = WheelMotion{.sum_mps = wheel_sum_m_ / wheels_s_, .difference_mps = {}};
    if (has_difference_) w.wheels->difference_mps = wheel_difference_m_ / wheels_s_;
  }
  w.up_s = up_s_;
  velocity_ = flux_ = {};
  turn_rad_ = velocity_change_mps_ = {};
  imu_s_ = intervals_s_ = wheels_s_ = wheel_sum_m_ = wheel_difference_m_ = 0;
  has_difference_ = false;
  return w;
}

}  // namespace tetap::doctor
