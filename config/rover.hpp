// SPDX-License-Identifier: Apache-2.0
// The default robot: a differential-drive rover with encoders, an IMU and a GNSS receiver, as simulated by
// sim_host/world. Inertial navigation, the attitude filter that judges it, and odometry. Geometry is that of
// the drawing; the world's wheels are unequal and its track is wider.
#pragma once

#include "config/parameters/rover.hpp"
#include "tetap/estimators/attitude.hpp"
#include "tetap/estimators/inertial/inertial.hpp"
#include "tetap/estimators/odometry.hpp"
#include "tetap/estimators/with_sensors.hpp"
#include "tetap/node/node.hpp"

namespace tetap::robot::rover {

// Sensors of this robot: no magnetometer, barometer or second antenna, so no code that fuses these is flashed.
using Attitude = estimators::WithSensors<estimators::Attitude, sensor::ImuSample>;
using Inertial = estimators::WithSensors<estimators::WatchedInertial, sensor::ImuSample, sensor::WheelCounts,
                                         sensor::GnssPosition, sensor::GnssVelocity>;
using Estimators = node::Estimators<estimators::Odometry, Attitude, Inertial>;

}  // namespace tetap::robot::rover
