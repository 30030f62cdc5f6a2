// SPDX-License-Identifier: Apache-2.0
// The robots of config/mrclam.hpp, with the same numbers, and a grid of poses in the place of the extended Kalman
// filter. A step of the grid has up to 3840 lines of cells, so it takes up to 39 ticks.
#pragma once

#include "config/mrclam.hpp"
#include "estimators/planar/pose_grid.hpp"

namespace tetap::robot::mrclam_grid {

using Estimators = node::Estimators<estimators::Odometry, estimators::PoseGrid<16, 32, 48>>;

inline constexpr param::Parameters parameters = param::checked([] {
  param::Parameters n = mrclam::parameters;
  n.loop.work_units = 100;
  return n;
}());

}  // namespace tetap::robot::mrclam_grid
