// SPDX-License-Identifier: Apache-2.0
// The robot of the TU Chemnitz labyrinth set: left and right wheel speeds, ultra-wideband ranges to four known anchors.
#pragma once

#include "config/parameters/labyrinth.hpp"
#include "tetap/estimators/odometry.hpp"
#include "tetap/estimators/planar/pose_ekf.hpp"
#include "tetap/node/node.hpp"

namespace tetap::robot::labyrinth {

using Estimators = node::Estimators<estimators::Odometry, estimators::PoseEkf>;

}  // namespace tetap::robot::labyrinth
