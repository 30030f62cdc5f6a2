// SPDX-License-Identifier: Apache-2.0
// The robot of config/graph.hpp with 128 keyframes, in the memory class of 64 kB: more of them are composed away.
#pragma once

#include "config/graph.hpp"

namespace tetap::robot::graph128 {

using Estimators = node::Estimators<estimators::Odometry, estimators::GraphMapper128>;

inline constexpr param::Parameters parameters = param::checked([] {
  param::Parameters n = graph::parameters;
  n.loop.work_units = 5'000;
  n.mapping.publish_every = 2;
  return n;
}());

}  // namespace tetap::robot::graph128
