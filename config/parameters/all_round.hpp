// SPDX-License-Identifier: Apache-2.0
// Parameters of the robot all_round (config/all_round.hpp): the rover with a scanner of 360 beams at 10 Hz.
#pragma once

#include "config/parameters/rover.hpp"
#include "tetap/param/limits.hpp"

namespace tetap::robot::all_round {

inline constexpr param::Parameters parameters = param::checked([] {
  param::Parameters n = rover::parameters;
  // A match against one keyframe has up to 8 000 units; the next keyframe is a second away.
  n.loop.work_units = 2'000;
  n.mapping = {.keyframe_distance_m = 3, .keyframe_turn_rad = 1, .keyframe_time_ms = 2'000};
  n.lidar = {.x_b_m = 0.2F, .min_m = 0.1F, .max_m = 30, .turn_us = 100'000};
  return n;
}());

}  // namespace tetap::robot::all_round
