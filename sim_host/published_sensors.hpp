// SPDX-License-Identifier: Apache-2.0
// Sensors that a robot is sent: those that one of its estimators takes and its parameters use. The world has them all;
// a bus need not. A fault of a sensor that is not sent cannot act.
#pragma once

#include "sim_host/robots.hpp"
#include "sim_host/simulated_robot.hpp"
#include "sim_host/world/world.hpp"

#include <algorithm>
#include <sstream>
#include <string>

namespace tetap::sim {

struct Sent {
  bool imu = false, landmarks = false, magnetometer = false, barometer = false;
  bool closures = false;            ///< a front end makes its keyframes and closes loops
  bool own_map = false;             ///< the robot makes its map, so it is given none
  bool nameless = false;            ///< the map needs no identities
  bool inertial = false;            ///< an inertial filter is there: what is a matched world for it is another one
  int scans_hz = 0, images_hz = 0;  ///< 0: none
  VehicleKind kind = VehicleKind::kDifferentialDrive;
  friend bool operator==(const Sent&, const Sent&) = default;
};

/// Turns a second; where all beams of a scan are of one time, as many as a usual scanner has.
[[nodiscard]] constexpr int scans_hz(const param::LidarParameters& n) {
  return n.turn_us > 0 ? std::max(1, 1'000'000 / n.turn_us) : 10;
}

[[nodiscard]] inline Sent sent_to(const EstimatorFacts& takes, const param::Parameters& n) {
  return {.imu = takes.needs_imu || (n.gyro.use != 0 && takes.imu),
          .landmarks = takes.sightings,
          .magnetometer = n.magnetic.use != 0 && takes.magnetic,
          .barometer = n.baro.use != 0 && takes.pressure,
          .closures = n.mapping.keyframes != 0 && takes.closures,
          .own_map = takes.own_map,
          .nameless = takes.nameless,
          .inertial = takes.inertial,
          .scans_hz = takes.scans ? scans_hz(n.lidar) : 0,
          .images_hz = takes.images && n.camera.any() ? 10 : 0,
          .kind = vehicle_kind(n, takes.inertial)};
}

/// Throws as parameters_of().
[[nodiscard]] inline Sent sent_to(const std::string& robot, const ParameterSettings& settings = {}) {
  const param::Parameters parameters = parameters_of(robot, settings);
  return sent_to(robot_named(robot).takes, parameters);
}

/// The world as that robot meets it.
inline void send_only(const Sent& sent, World::Options& world) {
  if (!sent.imu) world.parameters.imu.rate_hz = 0;
  if (sent.scans_hz > 0) world.parameters.lidar.rate_hz = sent.scans_hz;
  if (sent.images_hz > 0) world.parameters.features.rate_hz = sent.images_hz;
  if (!sent.landmarks) {
    world.parameters.camera.rate_hz = 0;
    // A scanner and a camera see them, whatever the node has of their map.
    if (world.parameters.lidar.rate_hz == 0 && world.parameters.features.rate_hz == 0) world.course.landmarks.clear();
    world.map_given = world.map_given && world.course.landmarks.empty();
  }
  world.parameters.magnetometer.rate_hz = sent.magnetometer ? 20 : 0;
  world.parameters.barometer.rate_hz = sent.barometer ? 10 : 0;
  world.parameters.scan_matcher.rate_hz = sent.closures ? 10 : 0;
  if (sent.kind == VehicleKind::kMulticopter) world.parameters.wheels.rate_hz = 0;
  world.inertial = sent.inertial;
}

/// The world with that robot's body, sensors and noise, as its header states them; `parameters` are those.
inline void simulate(const std::string& robot, const Sent& sent, const param::Parameters& parameters,
                     World::Options& world) {
  const bool from_world = robot.ends_with("_matched");  // sim_host/matched_rover.hpp
  simulate(parameters,
           {.kind = sent.kind,
            .inertial = sent.inertial,
            .landmarks = sent.landmarks,
            .own_map = sent.own_map,
            .nameless = sent.nameless,
            .scans = sent.scans_hz > 0,
            .images = sent.images_hz > 0,
            .own_noise = !from_world},
           world);
}

/// Names of the faults that act in that world, with a space between each.
[[nodiscard]] inline std::string applicable_faults(const World::Options& world) {
  std::string names;
  for (const FaultInfo& row : fault_table())
    if (can_act(row.fault, world)) (names += names.empty() ? "" : " ") += row.name;
  return names;
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
