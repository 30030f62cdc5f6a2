// SPDX-License-Identifier: Apache-2.0
// Parameters of the robot husky_inertial (config/husky_inertial.hpp).
#pragma once

#include "config/parameters/husky.hpp"
#include "tetap/param/limits.hpp"

namespace tetap::robot::husky_inertial {

inline constexpr param::Parameters parameters = param::checked([] {
  param::Parameters n = husky::parameters;
  // The sensor's z looks backwards, its x to the right: with it gravity, turns, accelerations and the IMU's own
  // orientation (level all the way) agree.
  n.inertial = {.mounting_bs = {0, 0, -1, -1, 0, 0, 0, 1, 0},
                // Vibration: 0.45 m/s^2 and 0.025 rad/s from one sample to the next, 33 ms later (median over the bag;
                // its covariances give 0.1 and 0.02).
                .gyro_radps_rthz = 5e-3F,
                .accel_mps2_rthz = 8e-2F,
                .start_tilt_rad = 0.1F,  // it starts while it drives
                // With 0.05 m/s 2 % of the speeds are refused at a gate of 99 %.
                .wheel_mps = 0.1F,
                .slip_share = 0.03F,
                .lateral_mps = 0.1F,
                .vertical_mps = 0.1F,
                .wheel_gate_scale = 2};
  return n;
}());

}  // namespace tetap::robot::husky_inertial
