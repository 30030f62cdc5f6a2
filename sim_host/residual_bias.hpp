// SPDX-License-Identifier: Apache-2.0
// Rest of the IMU's biases once the firmware has taken the robot's own calibration out of a sample
// (src/tetap/sensor/calibration.hpp). A published bias is held against this truth.
#pragma once

#include "sim_host/world/motion.hpp"
#include "sim_host/world/numbers.hpp"
#include "tetap/param/parameters.hpp"

#include <array>
#include <cstddef>

namespace tetap::sim {

namespace detail {
/// Matrix as param::Parameters has it, row by row.
[[nodiscard]] inline Vector3 times(const std::array<float, 9>& m, const Vector3& v) {
  Vector3 product{};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) product[i] += static_cast<double>(m[3 * i + j]) * v[j];
  return product;
}
}  // namespace detail

/// The truth with biases [rad/s, m/s^2] as they are after `parameters` were taken out, in the robot's body. Level and
/// at rest, as the truth has them: what the accelerometer's matrix makes of gravity is in.
[[nodiscard]] inline Truth residual_bias(Truth t, const param::Parameters& parameters, double temperature_degC) {
  const param::ImuParameters& n = parameters.imu;
  const double warmer = temperature_degC - static_cast<double>(n.gyro_bias_at_degC);
  for (std::size_t i = 0; i < 3; ++i) {
    t.gyro_bias_b_radps[i] -=
        static_cast<double>(n.gyro_bias_radps[i]) + static_cast<double>(n.gyro_bias_slope_radps_per_degC[i]) * warmer;
    t.accel_bias_b_mps2[i] -= static_cast<double>(n.accel_bias_mps2[i]);
  }
  t.accel_bias_b_mps2 = detail::times(n.accel_matrix, t.accel_bias_b_mps2);
  const auto& mounting = parameters.inertial.mounting_bs;
  const Vector3 level{kG0 * static_cast<double>(mounting[6]), kG0 * static_cast<double>(mounting[7]),
                      kG0 * static_cast<double>(mounting[8])};
  std::array<float, 9> off = n.accel_matrix;
  for (std::size_t i = 0; i < 3; ++i) off[4 * i] -= 1;
  t.accel_bias_b_mps2 = t.accel_bias_b_mps2 + detail::times(off, level);
  t.gyro_bias_b_radps = detail::times(parameters.inertial.mounting_bs, t.gyro_bias_b_radps);
  t.accel_bias_b_mps2 = detail::times(parameters.inertial.mounting_bs, t.accel_bias_b_mps2);
  return t;
}

}  // namespace tetap::sim
