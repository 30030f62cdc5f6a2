// SPDX-License-Identifier: Apache-2.0
// Parameters of the robot graph256 (config/graph256.hpp).
#pragma once

#include "config/parameters/graph.hpp"
#include "tetap/param/limits.hpp"

namespace tetap::robot::graph256 {

inline constexpr param::Parameters parameters = param::checked([] {
  param::Parameters n = graph::parameters;
  n.loop.work_units = 10'000;
  n.mapping.publish_every = 2;
  return n;
}());

}  // namespace tetap::robot::graph256
