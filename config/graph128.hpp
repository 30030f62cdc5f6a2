// SPDX-License-Identifier: Apache-2.0
// The robot of config/graph.hpp with 128 keyframes, in the memory class of 64 kB: more of them are composed away.
#pragma once

#include "config/parameters/graph128.hpp"
#include "tetap/estimators/mapping/graph_mapper.hpp"
#include "tetap/estimators/odometry.hpp"
#include "tetap/node/node.hpp"

namespace tetap::robot::graph128 {

using Estimators = node::Estimators<estimators::Odometry, estimators::GraphMapper128>;

}  // namespace tetap::robot::graph128
