// SPDX-License-Identifier: Apache-2.0
// The robot of config/graph.hpp with 256 keyframes, in the memory class of 128 kB: more of them are composed away.
#pragma once

#include "config/graph.hpp"

namespace tetap::robot::graph256 {

using Estimators = node::Estimators<estimators::Odometry, estimators::GraphMapper256>;

inline constexpr param::Parameters parameters = param::checked([] {
  param::Parameters n = graph::parameters;
  n.loop.work_units = 10'000;
  n.mapping.publish_every = 2;
  return n;
}());

}  // namespace tetap::robot::graph256
