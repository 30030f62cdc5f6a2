// SPDX-License-Identifier: Apache-2.0
// Iris, the quadrotor of PX4's simulator (PX4-ECL test/replay_data/iris_gps.csv): IMU, GNSS, magnetometer, barometer;
// no wheels, and nothing that keeps it from moving sideways. Noise: the defaults of PX4's EKF2 (PX4 parameter
// reference) for the samples of 5 ms that the log has, so that both filters give each sensor the same weight.
#pragma once

#include "config/parameters/iris.hpp"
#include "tetap/estimators/attitude.hpp"
#include "tetap/estimators/inertial/inertial.hpp"
#include "tetap/node/node.hpp"

namespace tetap::robot::iris {

using Estimators = node::Estimators<estimators::Attitude, estimators::WatchedInertial>;

}  // namespace tetap::robot::iris
