// SPDX-License-Identifier: Apache-2.0
// A robot with a planar laser scanner, in the memory class of 64 kB: odometry by matched scans, wheels between them.
#pragma once

#include "config/parameters/scanner.hpp"
#include "tetap/estimators/mapping/scan_odometry.hpp"
#include "tetap/estimators/odometry.hpp"
#include "tetap/node/node.hpp"

namespace tetap::robot::scanner {

using Estimators = node::Estimators<estimators::Odometry, estimators::ScanOdometry361>;

}  // namespace tetap::robot::scanner
