// SPDX-License-Identifier: Apache-2.0
// Parameters of the robot mapper (config/mapper.hpp).
#pragma once

#include "config/parameters/rover_landmarks.hpp"
#include "tetap/param/limits.hpp"

namespace tetap::robot::mapper {

inline constexpr param::Parameters parameters = param::checked([] {
  param::Parameters n = rover_landmarks::parameters;
  n.gnss = {};
  n.wired = {.imu = 1, .encoders = 1};
  n.landmark.gate_scale = 1.5F;
  // Sightings of one stamp have to fit together, which is what clutter and two near landmarks seldom do.
  n.mapping = {.association = 2};
  return n;
}());

}  // namespace tetap::robot::mapper
