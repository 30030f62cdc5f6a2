// SPDX-License-Identifier: Apache-2.0
// A lidar and a radar at rest that watch one target: an extended Kalman filter of constant velocity.
// Noise of the sensors as in Udacity's course "Self-Driving Car": lidar 0.15 m; radar 0.3 m, 0.03 rad, 0.3 m/s.
#pragma once

#include "config/parameters/tracker.hpp"
#include "tetap/estimators/target/target_tracker.hpp"
#include "tetap/node/node.hpp"

namespace tetap::robot::tracker {

using Estimators = node::Estimators<estimators::VelocityTracker>;

}  // namespace tetap::robot::tracker
