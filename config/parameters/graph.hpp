// SPDX-License-Identifier: Apache-2.0
// Parameters of the robot graph (config/graph.hpp).
#pragma once

#include "tetap/param/limits.hpp"

namespace tetap::robot::graph {

inline constexpr param::Parameters parameters = param::checked({
    // A closure names keyframes: half a tick of the bus is all that it waits for.
    .loop = {.window_us = 20'000, .ahead_us = 200'000, .work_units = 50'000},
    .wheels = {.drive = {.left_radius_m = 0.10F,
                         .right_radius_m = 0.10F,
                         .track_m = 0.50F,
                         .counts_per_turn = 2000,
                         .noise_left = 0.002F,
                         .noise_right = 0.002F},
               .most_mps = 10},
    .mapping = {.publish_every = 1, .keyframes = 1},
});

}  // namespace tetap::robot::graph
