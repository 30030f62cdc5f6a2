// SPDX-License-Identifier: Apache-2.0
// Parameters of the robot rover_landmarks (config/rover_landmarks.hpp).
#pragma once

#include "config/parameters/rover.hpp"
#include "tetap/param/limits.hpp"

namespace tetap::robot::rover_landmarks {

inline constexpr param::Parameters parameters = param::checked([] {
  param::Parameters n = rover::parameters;
  n.landmark = {.sigma_range_m = 0.12F, .sigma_range_per_m = 0.02F, .sigma_bearing_rad = 0.025F};
  // The receiver's error wanders over a minute: weight it down by what a fix repeats of the one before. The landmarks
  // fix the place in the plane.
  n.gnss = {.antenna_z_b_m = 0.4F, .sigma_floor_m = 0.3F, .sigma_scale = 4.0F};
  n.publish = {};
  return n;
}());

}  // namespace tetap::robot::rover_landmarks
