// SPDX-License-Identifier: Apache-2.0
// The robots of config/mrclam.hpp, with the same numbers, and a grid of poses in the place of the extended Kalman
// filter. A step of the grid has up to 3840 lines of cells, so it takes up to 39 ticks.
#pragma once

#include "config/parameters/mrclam_grid.hpp"
#include "tetap/estimators/odometry.hpp"
#include "tetap/estimators/planar/pose_grid.hpp"
#include "tetap/node/node.hpp"

namespace tetap::robot::mrclam_grid {

using Estimators = node::Estimators<estimators::Odometry, estimators::PoseGrid<16, 32, 48>>;

}  // namespace tetap::robot::mrclam_grid
