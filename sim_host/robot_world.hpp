// SPDX-License-Identifier: Apache-2.0
// The world of a robot: sensors that one of its estimators takes and its parameters use, its body, its place, and the
// course of its class. The world has all sensors; a bus need not. A fault of a sensor that is not sent cannot act.
#pragma once

#include "sim_host/robot.hpp"
#include "sim_host/simulated_robot.hpp"
#include "sim_host/world/floor_plan.hpp"
#include "sim_host/world/world.hpp"

#include <algorithm>
#include <optional>
#include <string>
#include <string_view>

namespace tetap::sim {

struct Sent {
  bool imu = false, landmarks = false, magnetometer = false, barometer = false;
  bool closures = false;            ///< a front end makes its keyframes and closes loops
  bool own_map = false;             ///< the robot makes its map, so it is given none
  bool in_lab = false;              ///< it has a map of the laboratory
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
          .in_lab = takes.given_map,
          .nameless = takes.nameless,
          .inertial = takes.inertial,
          .scans_hz = takes.scans ? scans_hz(n.lidar) : 0,
          .images_hz = takes.images && n.camera.any() ? 10 : 0,
          .kind = vehicle_kind(n, takes.inertial)};
}

/// The world as that robot meets it.
inline void send_only(const Sent& sent, World::Options& world) {
  if (!sent.imu) world.parameters.imu.rate_hz = 0;
  if (sent.scans_hz > 0) world.parameters.lidar.rate_hz = sent.scans_hz;
  if (sent.images_hz > 0) world.parameters.features.rate_hz = sent.images_hz;
  if (sent.images_hz > 0 && sent.own_map) world.parameters.features.recognise = true;
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
  world.surveyed = world.surveyed || sent.in_lab;
}

/// Origin of the robot's map where its parameters have one, else `otherwise`.
[[nodiscard]] inline GeodeticOrigin origin_of(const param::GnssParameters& n, const GeodeticOrigin& otherwise) {
  if (n.origin_configured == 0) return otherwise;
  return {static_cast<double>(n.origin_latitude_2ndeg) * 2e-9, static_cast<double>(n.origin_longitude_2ndeg) * 2e-9,
          static_cast<double>(n.origin_height_m)};
}

/// Name of the course of a robot's class.
[[nodiscard]] inline std::string_view usual_course(const Sent& sent) {
  return sent.kind == VehicleKind::kMulticopter ? "flight"
         : sent.kind == VehicleKind::kCar       ? "street"
         : sent.in_lab                          ? "lab"
         : sent.own_map                         ? "loop"
                                                : "yard";
}

/// Names of the courses that a vehicle of that kind can take.
[[nodiscard]] inline std::string_view course_names(VehicleKind kind) {
  return kind == VehicleKind::kMulticopter ? "flight or stand"
         : kind == VehicleKind::kCar       ? "street, road or stand"
                                           : "yard, loop, lab, corridor, road or stand";
}

struct Loop {
  double length_m = 60;
  int landmarks = 24;
};

/// Course of that name and its limits of speed; false where a vehicle of that kind cannot take it.
[[nodiscard]] inline bool set_course(std::string_view name, VehicleKind kind, int laps, const Loop& loop,
                                     World::Options& world) {
  const bool car = kind == VehicleKind::kCar, flies = kind == VehicleKind::kMulticopter;
  if (name == "stand") {
    world.course = {.waypoints = {{.x_m = 0, .y_m = 0, .stop_s = 86'400}, {.x_m = 1, .y_m = 0, .stop_s = 1}},
                    .landmarks = {}};
  } else if (name == "road" && !flies) {
    world.course = road_course(laps);
    world.limits.speed_mps = 5;
  } else if (name == "street" && car) {
    world.course = street_course(laps);
  } else if (name == "flight" && flies) {
    world.course = flight_course(laps);
  } else if (name == "loop" && !car && !flies) {
    world.course = loop_course(loop.length_m, laps, loop.landmarks);
  } else if ((name == "lab" || name == "corridor") && !car && !flies) {
    world.course = name == "lab" ? lab_course(laps) : corridor_course();
    world.limits.speed_mps = std::min(world.limits.speed_mps, 1.0);
  } else if (name == "yard" && !car && !flies) {
    world.course = default_course(laps);
  } else {
    return false;
  }
  return true;
}

/// Laps of a course, unless something else is asked for.
[[nodiscard]] inline int usual_laps(std::string_view course) { return course == "loop" ? 2 : 1; }

/// World of `tetap-world --robot NAME` without further options.
[[nodiscard]] inline World::Options usual_world(const Robot& robot) {
  const param::Parameters& n = *robot.parameters;
  const Sent sent = sent_to(robot.takes, n);
  World::Options world;
  simulate(robot.name, sent, n, world);
  world.origin = origin_of(n.gnss, world.origin);
  const std::string_view course = usual_course(sent);
  static_cast<void>(set_course(course, sent.kind, usual_laps(course), {}, world));
  send_only(sent, world);
  return world;
}

/// Names of the faults that act in that world, with a space between each.
[[nodiscard]] inline std::string applicable_faults(const World::Options& world) {
  std::string names;
  for (const FaultInfo& row : fault_table())
    if (can_act(row.fault, world)) (names += names.empty() ? "" : " ") += row.name;
  return names;
}

}  // namespace tetap::sim
