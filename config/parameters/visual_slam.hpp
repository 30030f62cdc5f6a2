// SPDX-License-Identifier: Apache-2.0
// Parameters of the robot visual_slam (config/visual_slam.hpp).
#pragma once

#include "config/parameters/visual.hpp"
#include "tetap/param/limits.hpp"

namespace tetap::robot::visual_slam {

inline constexpr param::Parameters parameters = param::checked([] {
  param::Parameters n = visual::parameters;
  n.loop.work_units = 50'000;  // a full map makes each update larger: those of an image take eight ticks
  return n;
}());

}  // namespace tetap::robot::visual_slam
