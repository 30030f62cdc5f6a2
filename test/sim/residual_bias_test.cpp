// SPDX-License-Identifier: Apache-2.0
// The truth of a calibrated robot's biases is what the firmware's own calibration leaves in a sample.
#include "sim_host/residual_bias.hpp"

#include "tetap/sensor/calibration.hpp"

#include <gtest/gtest.h>

namespace tetap {
namespace {

constexpr sim::Vector3 kGyro_radps{0.002, -0.001, 0.0005};
constexpr sim::Vector3 kAccel_mps2{0.05, -0.03, 0.02};
constexpr double kWarm_degC = 31;

sim::Truth truth() {
  sim::Truth t;
  t.gyro_bias_b_radps = kGyro_radps;
  t.accel_bias_b_mps2 = kAccel_mps2;
  return t;
}

TEST(BiasLeft, WithoutACalibrationIsTheWholeOfIt) {
  const sim::Truth left = sim::residual_bias(truth(), param::Parameters{}, kWarm_degC);
  EXPECT_EQ(left.gyro_bias_b_radps, kGyro_radps);
  EXPECT_EQ(left.accel_bias_b_mps2, kAccel_mps2);
}

TEST(BiasLeft, IsWhatTheFirmwareLeavesInASampleAtRest) {
  param::Parameters n;
  n.imu.gyro_bias_radps = {0.0015F, -0.002F, 0.001F};
  n.imu.gyro_bias_slope_radps_per_degC = {1e-5F, -2e-5F, 3e-5F};
  n.imu.accel_bias_mps2 = {0.04F, 0.01F, -0.02F};
  n.imu.accel_matrix = {1.01F, 0.002F, -0.003F, 0.004F, 0.99F, 0.005F, -0.006F, 0.007F, 1.02F};
  n.inertial.mounting_bs = {0, -1, 0, 1, 0, 0, 0, 0, 1};
  sensor::ImuSample s;
  constexpr double kInterval_s = 0.01;
  s.interval_us = 10'000;
  s.temperature_degC = static_cast<float>(kWarm_degC);
  for (std::size_t i = 0; i < 3; ++i) {
    s.dangle_b_rad[i] = static_cast<float>(kInterval_s * kGyro_radps[i]);
    s.dvelocity_b_mps[i] = static_cast<float>(kInterval_s * (kAccel_mps2[i] + (i == 2 ? sim::kG0 : 0.0)));
  }
  sensor::calibrate(s, n.imu);
  const sim::Truth left = sim::residual_bias(truth(), n, kWarm_degC);
  const auto in_body = [&n](const auto& v) {
    return sensor::times(n.inertial.mounting_bs, filter::Vector3{v[0], v[1], v[2]});
  };
  const filter::Vector3 turn = in_body(s.dangle_b_rad), force = in_body(s.dvelocity_b_mps);
  for (std::size_t i = 0; i < 3; ++i) {
    const int k = static_cast<int>(i);
    EXPECT_NEAR(left.gyro_bias_b_radps[i], static_cast<double>(turn(k)) / kInterval_s, 1e-9) << i;
    EXPECT_NEAR(left.accel_bias_b_mps2[i], static_cast<double>(force(k)) / kInterval_s - (i == 2 ? sim::kG0 : 0.0),
                5e-6)
        << i;
  }
}

}  // namespace
}  // namespace tetap
