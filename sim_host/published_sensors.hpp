// SPDX-License-Identifier: Apache-2.0
// Sensors that are sent to a robot of config/ by its name, and faults that cannot act on it.
#pragma once

#include "sim_host/robot_world.hpp"
#include "sim_host/robots.hpp"

#include <sstream>
#include <string>

namespace tetap::sim {

/// Throws as parameters_of().
[[nodiscard]] inline Sent sent_to(const std::string& robot, const ParameterSettings& settings = {}) {
  const param::Parameters parameters = parameters_of(robot, settings);
  return sent_to(robot_named(robot).takes, parameters);
}

/// Names of the robots that are built here and on which that fault acts in that world, with a space between each.
[[nodiscard]] inline std::string applicable_robots(Fault fault, const World::Options& world) {
  std::string names;
  std::istringstream all{robot_names()};
  for (std::string name; all >> name;) {
    if (!is_built(name)) continue;
    World::Options as_sent = world;
    send_only(sent_to(name), as_sent);
    if (can_act(fault, as_sent)) (names += names.empty() ? "" : " ") += name;
  }
  return names;
}

/// Reason why one of the faults of a world cannot act on that robot, with what could act, and on whom it would. Nothing
/// is taken from the world yet. Empty where all can.
[[nodiscard]] inline std::string cannot_act(const World::Options& world, const std::string& robot) {
  World::Options as_sent = world;
  send_only(sent_to(robot), as_sent);
  for (const FaultSetting& setting : world.faults) {
    if (can_act(setting.fault, as_sent)) continue;
    const FaultInfo& row = info(setting.fault);
    const char* const lacks = row.falls_on == FallsOn::kImu         ? "IMU"
                              : row.falls_on == FallsOn::kWheels    ? "wheels"
                              : row.falls_on == FallsOn::kGnss      ? "GNSS"
                              : row.falls_on == FallsOn::kLandmarks ? "landmarks"
                              : row.falls_on == FallsOn::kLidar     ? "LIDAR"
                              : row.falls_on == FallsOn::kFeatures  ? "camera"
                                                                    : "magnetometer";
    const std::string robots = applicable_robots(setting.fault, world);
    return "fault '" + std::string{row.name} + "': robot " + robot + " has no " + lacks +
           "; faults that act on it: " + applicable_faults(as_sent) +
           (robots.empty() ? "; in this world it acts on none" : "; robots on which it acts: " + robots);
  }
  return "";
}

}  // namespace tetap::sim
