// SPDX-License-Identifier: Apache-2.0
// What the devices of a log measured, second by second, for the pictures of the doctor's evidence.
#pragma once

#include "sim_host/doctor/robot_facts.hpp"
#include "sim_host/doctor/window.hpp"
#include "sim_host/page/module/json.hpp"

#include <vector>

namespace tetap::page {

/// The member "seconds": an array a quantity, null where a device is silent. t [s], middle of the window; turn [rad/s]
/// about up and turn_x .. turn_z in the sensor's axes; force_x .. force_z [m/s^2] in the robot's axes as `robot` states
/// them, sensor_x .. sensor_z in the sensor's; wheel_turn [rad/s] and wheel_speed [m/s]; east, north [m/s] by GNSS.
void put_seconds(Json& json, const std::vector<doctor::Window>& windows, const doctor::RobotFacts& robot);

}  // namespace tetap::page
