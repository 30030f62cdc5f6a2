// SPDX-License-Identifier: Apache-2.0
// Parameters of the robot graph128 (config/graph128.hpp).
#pragma once

#include "config/parameters/graph.hpp"
#include "tetap/param/limits.hpp"

namespace tetap::robot::graph128 {

inline constexpr param::Parameters parameters = param::checked([] {
  param::Parameters n = graph::parameters;
  n.loop.work_units = 5'000;
  n.mapping.publish_every = 2;
  return n;
}());

}  // namespace tetap::robot::graph128
