// SPDX-License-Identifier: Apache-2.0
// Known errors of a sensor's own are taken out of its samples before any estimator sees them. A function of the sample
// alone: a late one is corrected as it would have been in time.
#pragma once

#include "tetap/base/math.hpp"
#include "tetap/param/parameters.hpp"
#include "tetap/sensor/row_major.hpp"
#include "tetap/sensor/sample.hpp"

namespace tetap::sensor {

/// Increments without bias: f = T (raw - b), w = raw - b(temperature). tools/calibrate/calibrate_robot finds these
/// numbers.
inline void calibrate(ImuSample& s, const param::ImuParameters& n) {
  const float dt_s = base::seconds(base::Micros{s.interval_us});
  const float now = s.temperature_degC;
  const float warmer = now > -300.0F && now < 300.0F ? now - n.gyro_bias_at_degC : 0.0F;  // NaN: not available
  filter::Vector3 dv;
  for (std::size_t i = 0; i < 3; ++i) {
    s.dangle_b_rad[i] -= (n.gyro_bias_radps[i] + n.gyro_bias_slope_radps_per_degC[i] * warmer) * dt_s;
    dv(static_cast<int>(i)) = s.dvelocity_b_mps[i] - n.accel_bias_mps2[i] * dt_s;
  }
  const filter::Vector3 f = times(n.accel_matrix, dv);
  s.dvelocity_b_mps = {f(0), f(1), f(2)};
}

/// Range of a landmark: z = d / cos(bearing) for a depth d along the sensor's axis, without offset and scale. A bearing
/// beyond 80 degrees has no depth to speak of.
inline void calibrate(LandmarkSighting& s, const param::LandmarkParameters& n) {
  s.range_m = (s.range_m - n.range_offset_m) * n.range_scale;
  if (n.depth == 0 || !base::is_finite(s.bearing_rad)) return;
  constexpr float kLeastCosine = 0.17F;
  const float cosine = base::cos(s.bearing_rad);
  if (cosine > kLeastCosine) s.range_m /= cosine;
}

/// Time from the first beam of a scan to its last one.
[[nodiscard]] inline float sweep_s(const PlanarScan& s, const param::LidarParameters& n) {
  const float turns = base::abs(s.step_rad) * static_cast<float>(s.beams - 1) * (0.5F / base::kPi);
  return turns * base::seconds(base::Micros{n.turn_us});
}

/// A GNSS receiver's own: one with two antennas shows a heading.
[[nodiscard]] constexpr bool is_of_receiver(Sensor s) {
  return s == Sensor::kGnssPosition || s == Sensor::kGnssVelocity || s == Sensor::kHeading;
}

inline void calibrate(Sample& sample, const param::Parameters& n) {
  if (is_imu(sample, n.inertial.imu)) {
    calibrate(sample.payload.imu, n.imu);
  } else if (sample.sensor == sensor::Sensor::kWheelSpeed) {
    sample.payload.wheel_speeds.left_mps *= n.wheels.left_speed_scale;
    sample.payload.wheel_speeds.right_mps *= n.wheels.right_speed_scale;
  } else if (sample.sensor == sensor::Sensor::kBodySpeed) {
    sample.payload.body_speed.forward_mps *= n.wheels.speed_scale;
    sample.payload.body_speed.yaw_rate_radps *= n.wheels.yaw_rate_scale;  // NaN stays what it is
    sample.stamp += base::Micros{n.wheels.delay_us};
  } else if (sample.sensor == sensor::Sensor::kScan) {  // a scan is of the middle of its sweep
    const auto half_us = static_cast<std::int32_t>(0.5e6F * sweep_s(sample.payload.scan, n.lidar));
    sample.stamp += base::Micros{half_us - n.lidar.delay_us};
  } else if (sample.sensor == sensor::Sensor::kFeature) {
    sample.stamp = sample.stamp - base::Micros{n.camera.delay_us};
  } else if (is_of_receiver(sample.sensor)) {
    sample.stamp = sample.stamp - base::Micros{n.gnss.delay_us};
  }
}

}  // namespace tetap::sensor
