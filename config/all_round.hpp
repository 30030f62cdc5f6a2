// SPDX-License-Identifier: Apache-2.0
// IMU, wheels, GNSS and a planar laser scanner in one inertial filter, beside odometry.
#pragma once

#include "config/parameters/all_round.hpp"
#include "tetap/estimators/all_round/all_round.hpp"
#include "tetap/estimators/odometry.hpp"
#include "tetap/node/node.hpp"

namespace tetap::robot::all_round {

using Estimators = node::Estimators<estimators::Odometry, estimators::AllRound>;

}  // namespace tetap::robot::all_round
