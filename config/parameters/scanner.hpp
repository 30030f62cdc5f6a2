// SPDX-License-Identifier: Apache-2.0
// Parameters of the robot scanner (config/scanner.hpp): a differential drive with a scanner of 360 beams at 10 Hz.
#pragma once

#include "tetap/param/limits.hpp"

namespace tetap::robot::scanner {

inline constexpr param::Parameters parameters = param::checked({
    // Two scans fit the pool, so one has to leave the window before the next but one comes in. A match against four
    // keyframes has up to 30 000 units.
    .loop = {.period_us = 10'000, .window_us = 100'000, .work_units = 4'000},
    .wheels = {.drive = {.left_radius_m = 0.05F,
                         .right_radius_m = 0.05F,
                         .track_m = 0.3F,
                         .counts_per_turn = 2048,
                         .noise_left = 1e-3F,
                         .noise_right = 1e-3F},
               .noise = {.speed = 1e-4F,
                         .speed_per_speed = 1e-2F,
                         .yaw_rate = 1e-3F,
                         .yaw_rate_per_yaw_rate = 2e-2F,
                         .yaw_rate_per_speed = 2e-2F},
               .hold = param::Hold::kBackward},
    .wired = {.lidar = 1},
    .mapping = {.keyframe_distance_m = 0.3F, .keyframe_turn_rad = 0.3F},
    .lidar = {.min_m = 0.1F, .max_m = 12, .turn_us = 100'000},
});

}  // namespace tetap::robot::scanner
