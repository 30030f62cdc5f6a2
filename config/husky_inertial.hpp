// SPDX-License-Identifier: Apache-2.0
// The Husky of husky.hpp with inertial navigation in place of the planar filter: IMU 30 Hz, wheel odometry 10 Hz, and
// GNSS 2.5 Hz or the heading that the IMU (with its magnetometer) makes itself.
#pragma once

#include "config/parameters/husky_inertial.hpp"
#include "tetap/estimators/inertial/inertial.hpp"
#include "tetap/estimators/odometry.hpp"
#include "tetap/node/node.hpp"

namespace tetap::robot::husky_inertial {

using Estimators = node::Estimators<estimators::Odometry, estimators::WatchedInertial>;

}  // namespace tetap::robot::husky_inertial
