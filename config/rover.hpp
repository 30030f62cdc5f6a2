// SPDX-License-Identifier: Apache-2.0
// The default robot: a differential-drive rover with encoders, an IMU, a GNSS receiver and a camera that knows
// landmarks, as simulated by sim_host/world. Geometry is what the drawing says; the world's wheels are unequal and its
// track is wider.
#pragma once

#include "app/estimators/odometry.hpp"
#include "app/estimators/pose_ekf.hpp"
#include "app/node.hpp"
#include "app/numbers_check.hpp"

namespace tetap::robot::rover {

using Estimators = app::Estimators<app::Odometry, app::PoseEkf>;

inline constexpr app::Numbers numbers = app::checked({
    // GNSS fixes come 80 to 120 ms late, camera sightings 20 to 60 ms: all inside the window.
    .loop = {.period_us = 10'000, .window_us = 200'000, .ahead_us = 200'000},
    // k: slip and unequal wheels make the error of a wheel grow by 4 cm per root metre; the drawing gives radius, track
    // and encoder.
    .wheels = {.drive = {.left_radius_m = 0.10F,
                         .right_radius_m = 0.10F,
                         .track_m = 0.50F,
                         .counts_per_turn = 2000,
                         .noise_left = 0.002F,
                         .noise_right = 0.002F}},
    // ICM-42688-P: 0.0028 deg/s/sqrt(Hz) is 2.4e-9 rad^2/s; vibration and a 0.3 % scale error ask for more.
    .gyro = {.use = 1, .up_s = {0, 0, 1}, .noise = 4e-6F, .bias_time_s = 3},
    .landmark = {.sigma_range_m = 0.12F, .sigma_range_per_m = 0.02F, .sigma_bearing_rad = 0.025F},
    // The receiver's error wanders over a minute: weight it down by what a fix repeats of the one before.
    .gnss = {.sigma_floor_m = 0.3F, .sigma_scale = 4.0F},
});

}  // namespace tetap::robot::rover
