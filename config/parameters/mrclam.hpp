// SPDX-License-Identifier: Apache-2.0
// Parameters of the robot mrclam (config/mrclam.hpp).
#pragma once

#include "tetap/param/limits.hpp"

namespace tetap::robot::mrclam {

inline constexpr param::Parameters parameters = param::checked({
    .loop = {.window_us = 200'000, .ahead_us = 400'000},
    .wheels =
        {.drive = {.left_radius_m = 0.033F, .right_radius_m = 0.033F, .track_m = 0.235F, .counts_per_turn = 508.8F},
         .noise = {.speed = 0.002F, .yaw_rate = 0.0005F, .yaw_rate_per_yaw_rate = 0.01F, .yaw_rate_per_speed = 0.0005F},
         .hold = param::Hold::kForward,
         .delay_us = 200'000,      // from command to motion: the likelihood is flat between 0.2 and 0.3 s
         .yaw_rate_scale = 0.95F,  // turns come out short; flat between 0.90 and 0.97
         .timeout_us = 5'000'000,  // a command holds until the next
         .most_mps = 0.5F},        // Drive: -500 to 500 mm/s (iRobot Create Open Interface, 2006)
    // The camera knows a barcode's height, so what it calls range is the depth along its axis: range cos(bearing).
    // Offset and scale are the means of five fits, each to four robots (docs/validation/recorded.md).
    .landmark = {.sigma_range_m = 0.1F,
                 .sigma_range_per_m = 0.05F,
                 .sigma_bearing_rad = 0.02F,
                 .gate_scale = 1.5F,
                 .depth = 1,
                 .range_offset_m = 0.036F,
                 .range_scale = 0.974F},
    .recovery = {.after_us = 0, .at_least = 5, .inflate_position_m = 0.3F, .inflate_yaw_rad = 0.5F},
});

}  // namespace tetap::robot::mrclam
