// SPDX-License-Identifier: Apache-2.0
// The line of numbers that stands under a table of results names every noise that the wheels' and the fixes' models
// have: two configurations that differ there do not look the same.
#include "sim_host/numbers_words.hpp"

#include <gtest/gtest.h>

#include <string>

namespace tetap::sim {
namespace {

TEST(NumbersWords, another_noise_is_another_line) {
  param::Parameters n;
  const std::string before = numbers_words(n);
  for (float* const noise :
       {&n.wheels.noise.speed, &n.wheels.noise.speed_per_speed, &n.wheels.noise.yaw_rate,
        &n.wheels.noise.yaw_rate_per_yaw_rate, &n.wheels.noise.yaw_rate_per_speed, &n.wheels.wheel_speed_noise,
        &n.wheels.drive.noise_left, &n.wheels.drive.noise_right, &n.inertial.gyro_radps_rthz, &n.inertial.gyro_scale,
        &n.inertial.accel_mps2_rthz, &n.landmark.sigma_range_m, &n.landmark.sigma_range_per_m,
        &n.landmark.sigma_bearing_rad, &n.gnss.sigma_floor_m, &n.gnss.sigma_scale, &n.landmark.gate_scale,
        &n.gnss.gate_scale, &n.inertial.wheel_gate_scale}) {
    const float was = *noise;
    *noise = was + 0.5F;
    EXPECT_NE(numbers_words(n), before) << "number " << was;
    *noise = was;
  }
  n.wheels.wheel_speed_noise = 1.3e-5F;
  EXPECT_NE(numbers_words(n).find("wheel speed 1.3e-05, k left"), std::string::npos) << numbers_words(n);
}

}  // namespace
}  // namespace tetap::sim
