// SPDX-License-Identifier: Apache-2.0
// A pose graph of up to 4096 keyframes, on the host alone. A front end makes the keyframes: it sends the odometry
// between them and the closures (In_Closure), as tools/dataset/import_g2o writes them. With mapping.keyframes 0 the
// wheels make the keyframes.
#pragma once

#include "estimators/mapping/graph_mapper.hpp"
#include "estimators/odometry.hpp"
#include "node/node.hpp"
#include "param/limits.hpp"

namespace tetap::robot::graph {

using Estimators = node::Estimators<estimators::Odometry, estimators::GraphMapper4096>;

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
