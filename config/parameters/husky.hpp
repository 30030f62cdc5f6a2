// SPDX-License-Identifier: Apache-2.0
// Parameters of the robot husky (config/husky.hpp).
#pragma once

#include "tetap/param/limits.hpp"

namespace tetap::robot::husky {

inline constexpr param::Parameters parameters = param::checked({
    .loop = {.window_us = 200'000, .ahead_us = 200'000},
    .wheels =
        {.drive = {.left_radius_m = 0.165F, .right_radius_m = 0.165F, .track_m = 0.545F, .counts_per_turn = 78000.0F},
         .noise = {.speed = 0.0001F, .speed_per_speed = 0.002F, .yaw_rate = 0.0001F, .yaw_rate_per_yaw_rate = 0.01F}},
    // The sensor is mounted x right, y up, z backwards: gravity at rest and the turns of the wheels both show it.
    .gyro = {.use = 1, .up_s = {0, 1, 0}, .noise = 0.0001F},
    .gnss = {.sigma_floor_m = 0.5F, .sigma_scale = 2.0F},
});

}  // namespace tetap::robot::husky
