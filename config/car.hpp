// SPDX-License-Identifier: Apache-2.0
// A car with a consumer IMU, GNSS at 1 Hz and a speedometer (I. Skog, KTH: GNSSaidedINS_data.mat; the set gives neither
// mounting nor noise: the antenna is taken at the IMU, the noise from the first 20 s, at rest).
#pragma once

#include "config/parameters/car.hpp"
#include "tetap/estimators/inertial/inertial.hpp"
#include "tetap/node/node.hpp"

namespace tetap::robot::car {

using Estimators = node::Estimators<estimators::WatchedInertial>;

}  // namespace tetap::robot::car
