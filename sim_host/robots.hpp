// SPDX-License-Identifier: Apache-2.0
// The robots a host program can be: all of them, chosen by name. (A flash image holds one.)
#pragma once

#include "config/car.hpp"
#include "config/husky.hpp"
#include "config/husky_inertial.hpp"
#include "config/iris.hpp"
#include "config/labyrinth.hpp"
#include "config/mrclam.hpp"
#include "config/rover.hpp"
#include "config/rover_landmarks.hpp"
#include "sim_host/matched_rover.hpp"

#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>

namespace tetap::sim {

inline constexpr std::string_view kRobotNames =
    "car husky husky_inertial iris labyrinth mrclam rover rover_landmarks rover_landmarks_matched rover_matched";

/// Calls f(std::type_identity<Estimators>, numbers) for the robot of that name; false when there is none.
template <class F>
[[nodiscard]] bool with_robot(std::string_view name, F&& f) {
  if (name == "rover") return f(std::type_identity<robot::rover::Estimators>{}, robot::rover::numbers), true;
  if (name == "rover_landmarks")
    return f(std::type_identity<robot::rover_landmarks::Estimators>{}, robot::rover_landmarks::numbers), true;
  if (name == "car") return f(std::type_identity<robot::car::Estimators>{}, robot::car::numbers), true;
  if (name == "rover_landmarks_matched")
    return f(std::type_identity<robot::rover_landmarks::Estimators>{}, matched_landmarks_rover()), true;
  if (name == "rover_matched") return f(std::type_identity<robot::rover::Estimators>{}, matched_rover()), true;
  if (name == "mrclam") return f(std::type_identity<robot::mrclam::Estimators>{}, robot::mrclam::numbers), true;
  if (name == "husky") return f(std::type_identity<robot::husky::Estimators>{}, robot::husky::numbers), true;
  if (name == "husky_inertial")
    return f(std::type_identity<robot::husky_inertial::Estimators>{}, robot::husky_inertial::numbers), true;
  if (name == "iris") return f(std::type_identity<robot::iris::Estimators>{}, robot::iris::numbers), true;
  if (name == "labyrinth")
    return f(std::type_identity<robot::labyrinth::Estimators>{}, robot::labyrinth::numbers), true;
  return false;
}

/// Throws std::runtime_error with the names that exist when there is no such robot.
template <class F>
void for_robot(const std::string& name, F&& f) {
  if (!with_robot(name, f)) throw std::runtime_error("no robot '" + name + "'; there are: " + std::string(kRobotNames));
}

}  // namespace tetap::sim
