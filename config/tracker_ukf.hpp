// SPDX-License-Identifier: Apache-2.0
// A lidar and a radar at rest that watch one target: an unscented Kalman filter of constant turn rate and velocity.
// Noise of the sensors as in Udacity's course "Self-Driving Car": lidar 0.15 m; radar 0.3 m, 0.03 rad, 0.3 m/s.
#pragma once

#include "config/parameters/tracker_ukf.hpp"
#include "tetap/estimators/target/target_tracker.hpp"
#include "tetap/node/node.hpp"

namespace tetap::robot::tracker_ukf {

using Estimators = node::Estimators<estimators::TurnTracker>;

}  // namespace tetap::robot::tracker_ukf
