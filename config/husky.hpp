// SPDX-License-Identifier: Apache-2.0
// Clearpath Husky A200 of robot_localization's test bag: skid-steered, wheel odometry 10 Hz, IMU 30 Hz, GNSS 2.5 Hz.
// Yaw rate from the gyroscope, because skidding wheels do not measure it.
#pragma once

#include "config/parameters/husky.hpp"
#include "tetap/estimators/odometry.hpp"
#include "tetap/estimators/planar/pose_ekf.hpp"
#include "tetap/node/node.hpp"

namespace tetap::robot::husky {

using Estimators = node::Estimators<estimators::Odometry, estimators::PoseEkf>;

}  // namespace tetap::robot::husky
