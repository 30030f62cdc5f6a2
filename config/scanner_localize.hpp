// SPDX-License-Identifier: Apache-2.0
// The robot of config/scanner.hpp on a map that it is given, in the memory class of 64 kB. It may begin anywhere on the
// map of config/maps/lab.hpp, a laboratory of the simulated world.
#pragma once

#include "config/maps/lab.hpp"
#include "config/parameters/scanner_localize.hpp"
#include "tetap/estimators/mapping/scan_localizer.hpp"
#include "tetap/estimators/odometry.hpp"
#include "tetap/node/node.hpp"

namespace tetap::robot::scanner_localize {

struct Estimators : node::Estimators<estimators::Odometry, estimators::ScanLocalizer361> {
  static constexpr const slam::LikelihoodField& kField = maps::kLab;
};

}  // namespace tetap::robot::scanner_localize
