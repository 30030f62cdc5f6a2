// SPDX-License-Identifier: Apache-2.0
// Sensors that a robot is sent: those that one of its estimators takes and its parameters use. The world has them all;
// a bus need not. A fault of a sensor that is not sent cannot act.
#pragma once

#include "node/node.hpp"
#include "sim_host/robots.hpp"
#include "sim_host/simulated_robot.hpp"
#include "sim_host/world/world.hpp"

#include <concepts>
#include <sstream>
#include <string>

namespace tetap::sim {

/// An estimator that maps landmarks which its sightings do not name.
template <class E>
concept MapsNameless = requires {
  requires E::kTakesNameless;
};

/// With the sensor's instance or without.
template <class E, class Payload>
concept Takes = requires(E& e, const Payload& payload, base::Micros stamp, const estimators::Context& ctx) {
  e.fuse(payload, stamp, ctx);
}
|| requires(E& e, const Payload& payload, base::Micros stamp, const estimators::Context& ctx) {
  e.fuse(payload, stamp, std::uint8_t{}, ctx);
};

struct Sent {
  bool imu = false, landmarks = false, magnetometer = false, barometer = false;
  bool closures = false;  ///< a front end makes its keyframes and closes loops
  bool own_map = false;   ///< the robot makes its map, so it is given none
  bool nameless = false;  ///< the map needs no identities
  bool inertial = false;  ///< an inertial filter is there: what is a matched world for it is another one
  VehicleKind kind = VehicleKind::kDifferentialDrive;
  friend bool operator==(const Sent&, const Sent&) = default;
};

template <class... E>
[[nodiscard]] constexpr Sent sent_to(node::Estimators<E...>, const param::Parameters& n) {
  // These estimators need an IMU; for the others its gyroscope is one way to know the turn.
  constexpr bool kNeedsImu =
      ((E::kKind == sensor::EstimatorKind::kInertial || E::kKind == sensor::EstimatorKind::kAttitude) || ...);
  constexpr bool kInertial = ((E::kKind == sensor::EstimatorKind::kInertial) || ...);
  return {.imu = kNeedsImu || (n.gyro.use != 0 && (Takes<E, sensor::ImuSample> || ...)),
          .landmarks = (Takes<E, sensor::LandmarkSighting> || ...),
          .magnetometer = n.magnetic.use != 0 && (Takes<E, sensor::MagneticFlux> || ...),
          .barometer = n.baro.use != 0 && (Takes<E, sensor::AirPressure> || ...),
          .closures = n.mapping.keyframes != 0 && (Takes<E, sensor::LoopClosure> || ...),
          .own_map = (estimators::MakesMap<E> || ...),
          .nameless = (MapsNameless<E> || ...),
          .inertial = kInertial,
          .kind = vehicle_kind(n, kInertial)};
}

/// Throws std::runtime_error when there is no such robot.
[[nodiscard]] inline Sent sent_to(const std::string& robot, const ParameterSettings& settings = {}) {
  Sent sent;
  for_robot(robot, settings,
            [&]<class Estimators>(std::type_identity<Estimators>, const param::Parameters& parameters) {
              sent = sent_to(Estimators{}, parameters);
            });
  return sent;
}

/// The world as that robot meets it.
inline void send_only(const Sent& sent, World::Options& world) {
  if (!sent.imu) world.parameters.imu.rate_hz = 0;
  if (!sent.landmarks) world.parameters.camera.rate_hz = 0, world.course.landmarks.clear();
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

/// Names of the robots on which that fault acts in that world, with a space between each.
[[nodiscard]] inline std::string applicable_robots(Fault fault, const World::Options& world) {
  std::string names;
  std::istringstream all{kRobotNames};
  for (std::string name; all >> name;) {
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
                                                                    : "magnetometer";
    const std::string robots = applicable_robots(setting.fault, world);
    return "fault '" + std::string{row.name} + "': robot " + robot + " has no " + lacks +
           "; faults that act on it: " + applicable_faults(as_sent) +
           (robots.empty() ? "; in this world it acts on none" : "; robots on which it acts: " + robots);
  }
  return "";
}

}  // namespace tetap::sim
