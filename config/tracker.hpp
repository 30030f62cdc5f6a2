// SPDX-License-Identifier: Apache-2.0
// A lidar and a radar at rest that watch one target: an extended Kalman filter of constant velocity.
// Noise of the sensors as in Udacity's course "Self-Driving Car": lidar 0.15 m; radar 0.3 m, 0.03 rad, 0.3 m/s.
#pragma once

#include "estimators/target/target_tracker.hpp"
#include "node/node.hpp"
#include "param/limits.hpp"

namespace tetap::robot::tracker {

using Estimators = node::Estimators<estimators::VelocityTracker>;

inline constexpr param::Parameters parameters = param::checked({
    .target = {.acceleration_mps2 = 3, .gate_scale = 3},
    .recovery = {.after_us = 0, .at_least = 5},
});

}  // namespace tetap::robot::tracker
