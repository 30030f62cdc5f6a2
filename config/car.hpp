// SPDX-License-Identifier: Apache-2.0
// A car with a consumer IMU, GNSS at 1 Hz and a speedometer (I. Skog, KTH: GNSSaidedINS_data.mat; the set gives neither
// mounting nor noise: the antenna is taken at the IMU, the noise from the first 20 s, at rest).
#pragma once

#include "app/estimators/inertial.hpp"
#include "app/node.hpp"
#include "app/numbers_check.hpp"

namespace tetap::robot::car {

using Estimators = app::Estimators<app::Inertial>;

inline constexpr app::Numbers numbers = app::checked({
    .loop = {.period_us = 10'000, .window_us = 200'000, .ahead_us = 200'000},
    .gnss = {.sigma_floor_m = 1.0F, .gate_scale = 2, .align_distance_m = 15},
    .inertial =
        {// Level from the first 19 s, the yaw of the sensor from accelerations against the speedometer's.
         .mounting_bs = {0.99281F, 0.08908F, 0.08F, -0.08229F, 0.99302F, -0.08449F, -0.08697F, 0.0773F, 0.99321F},
         .gyro_radps_rthz = 1e-3F,
         .accel_mps2_rthz = 3e-2F,
         .gyro_bias_radps2_rthz = 2e-5F,
         .accel_bias_mps3_rthz = 1e-3F,
         .gyro_turn_on_radps = 0.02F,
         .accel_turn_on_mps2 = 0.3F,
         .start_tilt_rad = 0.1F,
         .wheel_mps = 0.2F,
         .slip_share = 0.03F,
         .lateral_mps = 0.5F,
         .vertical_mps = 0.5F},
    // Fixes come once a second.
    .recovery = {.after_us = 3'000'000, .at_least = 4},
});

}  // namespace tetap::robot::car
