// SPDX-License-Identifier: Apache-2.0
// The robot of config/scanner.hpp with a pose graph, in the memory class of 256 kB: it closes loops by its own scans.
#pragma once

#include "config/parameters/scanner_map.hpp"
#include "tetap/estimators/mapping/scan_mapper.hpp"
#include "tetap/estimators/odometry.hpp"
#include "tetap/node/node.hpp"

namespace tetap::robot::scanner_map {

using Estimators = node::Estimators<estimators::Odometry, estimators::ScanMapper192>;

}  // namespace tetap::robot::scanner_map
