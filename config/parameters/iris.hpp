// SPDX-License-Identifier: Apache-2.0
// Parameters of the robot iris (config/iris.hpp).
#pragma once

#include "tetap/param/limits.hpp"

namespace tetap::robot::iris {

inline constexpr param::Parameters parameters = param::checked({
    .loop = {.period_us = 10'000, .window_us = 200'000, .ahead_us = 200'000},
    // EKF2_GPS_V_NOISE, EKF2_GPS_P_NOISE; the gates of five sigma EKF2_GPS_P_GATE and EKF2_GPS_V_GATE.
    .gnss = {.sigma_velocity_floor_mps = 0.3F, .sigma_floor_m = 0.5F, .gate_scale = 2},
    .inertial = {.gyro_radps_rthz = 1.1e-3F,      // EKF2_GYR_NOISE 0.015 rad/s in each sample
                 .accel_mps2_rthz = 2.5e-2F,      // EKF2_ACC_NOISE 0.35 m/s^2
                 .gyro_bias_radps2_rthz = 7e-5F,  // EKF2_GYR_B_NOISE 0.001 rad/s^2
                 .accel_bias_mps3_rthz = 2e-4F,   // EKF2_ACC_B_NOISE 0.003 m/s^3
                 .gyro_turn_on_radps = 0.1F,      // EKF2_GBIAS_INIT
                 .accel_turn_on_mps2 = 0.2F,      // EKF2_ABIAS_INIT
                 .start_tilt_rad = 0.1F},         // EKF2_ANGERR_INIT
    // North as PX4's own estimate of the field has it at the end of the log (0.204 G north, 0.002 G east): the log has
    // no figure of the declination that its simulator used, and at 47 N 9 E the Earth's is 0.05 rad.
    .magnetic = {.use = 1, .declination_rad = 0.01F},
    .baro = {.use = 1},
    // Many sensors, so many innovations: within 600 frames/s (test/replay/worlds.sh).
    .publish = {.std_every = 10, .state_every = 10},
});

}  // namespace tetap::robot::iris
