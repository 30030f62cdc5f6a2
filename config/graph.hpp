// SPDX-License-Identifier: Apache-2.0
// A pose graph of up to 4096 keyframes, on the host alone. A front end makes the keyframes: it sends the odometry
// between them and the closures (In_Closure), as tools/dataset/import_g2o writes them. With mapping.keyframes 0 the
// wheels make the keyframes.
#pragma once

#include "config/parameters/graph.hpp"
#include "tetap/estimators/mapping/graph_mapper.hpp"
#include "tetap/estimators/odometry.hpp"
#include "tetap/node/node.hpp"

namespace tetap::robot::graph {

using Estimators = node::Estimators<estimators::Odometry, estimators::GraphMapper4096>;

}  // namespace tetap::robot::graph
