// SPDX-License-Identifier: Apache-2.0
// Parameters of the robot mrclam_grid (config/mrclam_grid.hpp).
#pragma once

#include "config/parameters/mrclam.hpp"
#include "tetap/param/limits.hpp"

namespace tetap::robot::mrclam_grid {

inline constexpr param::Parameters parameters = param::checked([] {
  param::Parameters n = mrclam::parameters;
  n.loop.work_units = 100;
  return n;
}());

}  // namespace tetap::robot::mrclam_grid
