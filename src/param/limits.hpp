// SPDX-License-Identifier: Apache-2.0
// A robot's numbers are refused where they are written: `constexpr Numbers numbers = checked({...})` does not compile
// when one of them makes no sense, and the compiler's message names it.
#pragma once

#include "param/parameters.hpp"

namespace tetap::param {

namespace detail {
/// Not constexpr on purpose: to reach it ends a constant expression, with the text in the compiler's message.
inline void this_number_makes_no_sense(const char* /*which*/) {}

consteval void require(bool holds, const char* which) {
  if (!holds) this_number_makes_no_sense(which);
}
/// Finite and above (or not below) zero; false for NaN.
consteval bool positive(float x) { return x > 0 && x < 1e30F; }
consteval bool not_negative(float x) { return x >= 0 && x < 1e30F; }
consteval bool finite(float x) { return x > -1e30F && x < 1e30F; }
consteval float determinant(const std::array<float, 9>& m) {
  return m[0] * (m[4] * m[8] - m[5] * m[7]) - m[1] * (m[3] * m[8] - m[5] * m[6]) + m[2] * (m[3] * m[7] - m[4] * m[6]);
}
/// Orthogonal and not a mirror, to a thousandth.
consteval bool rotation(const std::array<float, 9>& m) {
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) {
      const float off =
          m[3 * i] * m[3 * j] + m[3 * i + 1] * m[3 * j + 1] + m[3 * i + 2] * m[3 * j + 2] - (i == j ? 1.0F : 0.0F);
      if (!(off > -2e-3F && off < 2e-3F)) return false;
    }
  return determinant(m) > 0;
}
/// A sensor's scale and misalignment: the turn into the body's axes is another number.
consteval bool nearly_one(const std::array<float, 9>& m) {
  for (std::size_t i = 0; i < 9; ++i) {
    const float off = m[i] - (i % 4 == 0 ? 1.0F : 0.0F);
    if (!(off > -0.2F && off < 0.2F)) return false;
  }
  return true;
}
}  // namespace detail

consteval Parameters checked(const Parameters& n) {
  using detail::finite;
  using detail::not_negative;
  using detail::positive;
  using detail::require;
  require(n.can_base % 64 == 0 && n.can_base <= 0x7C0, "can_base: a multiple of 64 up to 0x7C0");
  require(n.loop.period_us > 0 && n.loop.period_us <= 100'000, "loop.period_us: 1 to 100000");
  require(n.loop.window_us >= n.loop.period_us && n.loop.window_us <= 500'000, "loop.window_us: the period to 500000");
  require(n.loop.ahead_us >= 0 && n.loop.ahead_us <= 500'000, "loop.ahead_us: 0 to 500000");
  require(not_negative(n.loop.turn_radps2), "loop.turn_radps2: not below 0");

  const auto& d = n.wheels.drive;
  // All zero: the robot has no wheels of its own to count.
  const bool wheels = !(d.left_radius_m <= 0 && d.left_radius_m >= 0 && d.track_m <= 0 && d.track_m >= 0);
  require(!wheels || positive(d.left_radius_m), "wheels.drive.left_radius_m: above 0");
  require(!wheels || positive(d.right_radius_m), "wheels.drive.right_radius_m: above 0");
  require(!wheels || positive(d.track_m), "wheels.drive.track_m: above 0");
  require(positive(d.counts_per_turn), "wheels.drive.counts_per_turn: above 0");
  require(not_negative(d.noise_left) && not_negative(d.noise_right),
          "wheels.drive.noise_left, noise_right: not below 0");
  const auto& u = n.wheels.noise;
  require(not_negative(u.speed) && not_negative(u.speed_per_speed) && not_negative(u.yaw_rate) &&
              not_negative(u.yaw_rate_per_yaw_rate) && not_negative(u.yaw_rate_per_speed),
          "wheels.noise: densities not below 0");
  require(not_negative(n.wheels.wheel_speed_noise), "wheels.wheel_speed_noise: not below 0");
  require(n.wheels.delay_us >= 0 && n.wheels.delay_us <= 500'000, "wheels.delay_us: 0 to 500000");
  require(positive(n.wheels.speed_scale) && positive(n.wheels.yaw_rate_scale) && positive(n.wheels.left_speed_scale) &&
              positive(n.wheels.right_speed_scale),
          "wheels scales: above 0");
  require(n.wheels.timeout_us > 0, "wheels.timeout_us: above 0");
  require(positive(n.wheels.timeout_noise), "wheels.timeout_noise: above 0");

  const auto within = [](const std::array<float, 3>& values, float limit) {
    for (const float v : values)
      if (!(v > -limit && v < limit)) return false;
    return true;
  };
  require(within(n.imu.accel_bias_mps2, 10) && within(n.imu.gyro_bias_radps, 1),
          "imu.accel_bias_mps2, gyro_bias_radps: within 10 m/s^2 and 1 rad/s");
  require(within(n.imu.gyro_bias_slope_radps_per_degC, 0.1F), "imu.gyro_bias_slope_radps_per_degC: within 0.1");
  require(n.imu.gyro_bias_at_degC > -100 && n.imu.gyro_bias_at_degC < 200, "imu.gyro_bias_at_degC: -100 to 200");
  require(detail::nearly_one(n.imu.accel_matrix), "imu.accel_matrix: within 0.2 of no change, in every place");

  const auto& up = n.gyro.up_s;
  const float norm2 = up[0] * up[0] + up[1] * up[1] + up[2] * up[2];
  require(norm2 > 0.99F && norm2 < 1.01F, "gyro.up_s: a unit vector");
  require(not_negative(n.gyro.noise), "gyro.noise: not below 0");
  require(positive(n.gyro.bias_time_s), "gyro.bias_time_s: above 0");
  require(positive(n.gyro.standstill_mps), "gyro.standstill_mps: above 0");

  const auto& l = n.landmark;
  require(positive(l.sigma_range_m), "landmark.sigma_range_m: above 0");
  require(not_negative(l.sigma_range_per_m), "landmark.sigma_range_per_m: not below 0");
  require(positive(l.sigma_bearing_rad), "landmark.sigma_bearing_rad: above 0");
  require(positive(l.sigma_range_only_m), "landmark.sigma_range_only_m: above 0");
  require(positive(l.gate_scale), "landmark.gate_scale: above 0");

  const auto& g = n.gnss;
  require(finite(g.antenna_x_b_m) && finite(g.antenna_y_b_m), "gnss.antenna_x_b_m, antenna_y_b_m: finite");
  require(positive(g.sigma_floor_m), "gnss.sigma_floor_m: above 0");
  require(positive(g.sigma_scale), "gnss.sigma_scale: above 0");
  require(g.correlation_s >= 0 && g.correlation_s <= 3600, "gnss.correlation_s: 0 to 3600");
  require(positive(g.gate_scale), "gnss.gate_scale: above 0");
  require(positive(g.align_distance_m), "gnss.align_distance_m: above 0");

  require(n.inertial.constrain_every_us >= 0, "inertial.constrain_every_us: not below 0");
  const auto& i = n.inertial;
  require(detail::rotation(i.mounting_bs), "inertial.mounting_bs: a rotation");
  require(i.imu >= 0 && i.imu <= 3, "inertial.imu: 0 to 3");
  require(positive(i.gyro_radps_rthz) && positive(i.accel_mps2_rthz) && not_negative(i.gyro_bias_radps2_rthz) &&
              not_negative(i.accel_bias_mps3_rthz),
          "inertial: noise densities above 0, random walks not below");
  require(i.gyro_scale >= 0 && i.gyro_scale < 0.2F, "inertial.gyro_scale: 0 to 0.2, of one");
  require(positive(i.gyro_turn_on_radps) && positive(i.accel_turn_on_mps2) && positive(i.start_tilt_rad),
          "inertial.gyro_turn_on_radps, accel_turn_on_mps2, start_tilt_rad: above 0");
  require(i.wheels_every_us >= 0 && 2 * std::int64_t{i.wheels_every_us} <= n.wheels.timeout_us,
          "inertial.wheels_every_us: 0 to half of wheels.timeout_us");
  require(i.stuck_samples >= 0 && i.stuck_samples <= 255, "inertial.stuck_samples: 0 to 255");
  require(i.earth_rate == 0 || i.earth_rate == 1, "inertial.earth_rate: 0 or 1");
  const auto& line = n.gnss.baseline_b_m;
  require(within(line, 100.0F) && line[0] * line[0] + line[1] * line[1] > 1e-4F,
          "gnss.baseline_b_m: below 100 m, and not upright");
  require(n.gnss.heading_stuck_samples >= 0 && n.gnss.heading_stuck_samples <= 255,
          "gnss.heading_stuck_samples: 0 to 255");
  require(n.magnetic.stuck_samples >= 0 && n.magnetic.stuck_samples <= 255, "magnetic.stuck_samples: 0 to 255");
  require(n.baro.stuck_samples >= 0 && n.baro.stuck_samples <= 255, "baro.stuck_samples: 0 to 255");
  require(i.stale_us > 0 && i.stale_us <= 10'000'000, "inertial.stale_us: 1 to 10000000");
  require(positive(i.vibration_mps2) && positive(i.vibration_radps), "inertial.vibration_*: above 0");
  require(not_negative(i.calm_mps2) && not_negative(i.calm_radps), "inertial.calm_*: not below 0");
  require(positive(i.gap_wheels_radps), "inertial.gap_wheels_radps: above 0");
  require(positive(i.still_mps) && positive(i.still_gnss_mps), "inertial.still_mps, still_gnss_mps: above 0");
  require(not_negative(i.slip_mps) && not_negative(i.slip_share), "inertial.slip_*: not below 0");

  const auto& m = n.magnetic;
  require(m.declination_rad > -3.2F && m.declination_rad < 3.2F, "magnetic.declination_rad: -pi to pi");
  require(finite(m.hard_iron_uT[0]) && finite(m.hard_iron_uT[1]) && finite(m.hard_iron_uT[2]),
          "magnetic.hard_iron_uT: finite");
  require(positive(detail::determinant(m.soft_iron)), "magnetic.soft_iron: a matrix that mirrors nothing");
  require(detail::rotation(m.mounting_bs), "magnetic.mounting_bs: a rotation");
  require(positive(m.sigma_rad) && positive(m.gate_scale), "magnetic.sigma_rad, gate_scale: above 0");
  require(not_negative(m.norm_uT), "magnetic.norm_uT: not below 0");
  require(m.norm_share > 0 && m.norm_share < 1, "magnetic.norm_share: between 0 and 1");
  require(m.dip_rad > 0 && m.dip_rad < 1.5F, "magnetic.dip_rad: between 0 and 1.5");
  require(positive(m.field_new_s), "magnetic.field_new_s: above 0");
  require(positive(n.baro.sigma_m) && positive(n.baro.gate_scale), "baro.sigma_m, gate_scale: above 0");
  require(not_negative(n.baro.drift_m_rts) && not_negative(n.baro.scale_share),
          "baro.drift_m_rts, scale_share: not below 0");
  require(!(n.attitude.declination_rad < 0 || n.attitude.declination_rad > 0),
          "attitude.declination_rad: give it as magnetic.declination_rad");
  bool options = true;
  n.attitude.each([&options](float option) { options = options && option >= 0 && option < 1e30F; });
  require(options, "attitude: options finite, not below 0");
  require(positive(n.disagreement.tilt_rad) && positive(n.disagreement.heading_rad) && n.disagreement.after_us >= 0,
          "disagreement: angles above 0, after_us not below 0");

  const PublishParameters& p = n.publish;
  require((p.attitude_every <= 0 || p.state_every % p.attitude_every == 0) &&
              (p.std_every <= 0 || p.state_every % p.std_every == 0),
          "publish.state_every: a multiple of attitude_every and std_every");
  require(positive(n.start.sigma_position_m), "start.sigma_position_m: above 0");
  require(positive(n.start.sigma_yaw_rad), "start.sigma_yaw_rad: above 0");
  require(n.recovery.after_us >= 0 && n.recovery.at_least >= 1, "recovery.after_us not below 0, at_least from 1");
  require(positive(n.recovery.inflate_position_m) && positive(n.recovery.inflate_yaw_rad),
          "recovery.inflate_*: above 0");
  require(n.recovery.persist_us > 0 && n.recovery.persist_fixes >= 2,
          "recovery.persist_us above 0, persist_fixes from 2");
  require(n.recovery.confirm_fixes >= 2 && n.recovery.confirm_fixes <= n.recovery.persist_fixes,
          "recovery.confirm_fixes: 2 to persist_fixes");
  require(positive(n.recovery.frozen_m), "recovery.frozen_m: above 0");
  return n;
}

}  // namespace tetap::param
