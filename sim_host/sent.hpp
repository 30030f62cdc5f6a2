// SPDX-License-Identifier: Apache-2.0
// Which sensors a robot is sent: those that one of its estimators takes. The world has them all; a bus need not.
#pragma once

#include "app/node.hpp"
#include "sim_host/robots.hpp"
#include "sim_host/world/world.hpp"

#include <concepts>
#include <string>

namespace tetap::sim {

template <class E, class Payload>
concept Takes = requires(E& e, const Payload& payload, base::Micros stamp, const app::Context& with) {
  e.fuse(payload, stamp, with);
};

struct Sent {
  bool landmarks = false, magnetometer = false, barometer = false;
  bool inertial = false;  ///< an inertial filter is there: what is a matched world for it is another one
};

template <class... E>
[[nodiscard]] constexpr Sent sent_to(app::Estimators<E...>) {
  return {.landmarks = (Takes<E, app::LandmarkSighting> || ...),
          .magnetometer = (Takes<E, app::MagneticFlux> || ...),
          .barometer = (Takes<E, app::AirPressure> || ...),
          .inertial = ((E::kKind == can::EstimatorKind::kInertial) || ...)};
}

/// Throws std::runtime_error when there is no such robot.
[[nodiscard]] inline Sent sent_to(const std::string& robot) {
  Sent sent;
  for_robot(robot, [&]<class Estimators>(std::type_identity<Estimators>, const app::Numbers&) {
    sent = sent_to(Estimators{});
  });
  return sent;
}

/// The world as that robot meets it.
inline void send_only(const Sent& sent, World::Options& world) {
  if (!sent.landmarks) world.numbers.camera.rate_hz = 0, world.course.landmarks.clear();
  world.numbers.magnetometer.rate_hz = sent.magnetometer ? 20 : 0;
  world.numbers.barometer.rate_hz = sent.barometer ? 10 : 0;
  world.inertial = sent.inertial;
}

}  // namespace tetap::sim
