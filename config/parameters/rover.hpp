// SPDX-License-Identifier: Apache-2.0
// Parameters of the robot rover (config/rover.hpp).
#pragma once

#include "tetap/param/limits.hpp"

namespace tetap::robot::rover {

inline constexpr param::Parameters parameters = param::checked({
    // GNSS fixes come 80 to 120 ms late: all inside the window.
    .loop = {.period_us = 10'000, .window_us = 200'000, .ahead_us = 200'000},
    // k: slip and unequal wheels make the error of a wheel grow by 4 cm per root metre; the drawing gives radius, track
    // and encoder.
    .wheels = {.drive = {.left_radius_m = 0.10F,
                         .right_radius_m = 0.10F,
                         .track_m = 0.50F,
                         .counts_per_turn = 2000,
                         .noise_left = 0.002F,
                         .noise_right = 0.002F},
               // Twice the 5 m/s that it drives.
               .most_mps = 10},
    // ICM-42688-P: 0.0028 deg/s/sqrt(Hz) is 2.4e-9 rad^2/s; vibration and a 0.3 % scale error ask for more.
    .gyro = {.use = 1, .up_s = {0, 0, 1}, .noise = 4e-6F, .bias_time_s = 3},
    // The origin is the simulated world's. Anywhere else the first confirmed fix takes its place.
    .gnss = {.antenna_z_b_m = 0.4F,
             .sigma_floor_m = 0.3F,
             // The receiver's error wanders over a minute: what a fix repeats of the one before weighs less.
             .correlation_s = 60,
             // Gates of 99.9 % and more: one of 99 % refuses every hundredth good measurement, and always the one that
             // would have corrected most (velocity's NEES 3.04 of 3 in the matched world, with these 2.98).
             .gate_scale = 1.6F,
             .origin_configured = 2,
             .origin_latitude_2ndeg = 24'131'350'000,
             .origin_longitude_2ndeg = 5'834'150'000,
             .origin_height_m = 520},
    // The vibration of a wheeled robot is far above the data sheet's noise: so much for the accelerometer as it is at 5
    // m/s; so much for the gyroscope that a bias that steps does not lead it far. What a wrong scale makes of turns is
    // gyro_scale's.
    .inertial =
        {.gyro_radps_rthz = 2e-3F, .accel_mps2_rthz = 5e-2F, .wheel_gate_scale = 1.6F, .constrain_every_us = 20'000},
    // Three estimators share the bus: 591 frames/s at most (tools/can/generate_messages --load).
    .publish = {.std_every = 10, .side_every = 20, .attitude_every = 10, .state_every = 10},
    // On a board that has them: 1 kHz of the IMU in increments of 10 ms, as the bus carries them.
    .wired = {.imu = 1, .encoders = 1, .gnss = 2},
});

}  // namespace tetap::robot::rover
