// SPDX-License-Identifier: Apache-2.0
// The robot of config/graph.hpp with 256 keyframes, in the memory class of 128 kB: more of them are composed away.
#pragma once

#include "config/parameters/graph256.hpp"
#include "tetap/estimators/mapping/graph_mapper.hpp"
#include "tetap/estimators/odometry.hpp"
#include "tetap/node/node.hpp"

namespace tetap::robot::graph256 {

using Estimators = node::Estimators<estimators::Odometry, estimators::GraphMapper256>;

}  // namespace tetap::robot::graph256
