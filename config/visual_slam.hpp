// SPDX-License-Identifier: Apache-2.0
// The robot visual with a map of 64 points that its camera's front end recognises, in the memory class of 256 kB.
#pragma once

#include "config/parameters/visual_slam.hpp"
#include "tetap/estimators/odometry.hpp"
#include "tetap/estimators/visual/visual_odometry.hpp"
#include "tetap/node/node.hpp"

namespace tetap::robot::visual_slam {

using Estimators = node::Estimators<estimators::Odometry, estimators::VisualSlam64>;

}  // namespace tetap::robot::visual_slam
