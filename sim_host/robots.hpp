// SPDX-License-Identifier: Apache-2.0
// The robots a host program can be: all of them, chosen by name. (A flash image holds one.)
#pragma once

#include "configured_robots.hpp"  // made by CMake of what lies in config/
#include "sim_host/matched_rover.hpp"
#include "sim_host/parameter_settings.hpp"

#include <array>
#include <cstdint>
#include <cstdio>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>

namespace tetap::sim {

inline const std::string kRobotNames = std::string(kConfiguredRobots) + " rover_landmarks_matched rover_matched";

/// Calls f(std::type_identity<Estimators>, parameters) for the robot of that name; false when there is none.
template <class F>
[[nodiscard]] bool with_robot(std::string_view name, F&& f) {
  if (name == "rover_landmarks_matched")
    return f(std::type_identity<robot::rover_landmarks::Estimators>{}, matched_landmarks_rover()), true;
  if (name == "rover_matched") return f(std::type_identity<robot::rover::Estimators>{}, matched_rover()), true;
  return with_configured_robot(name, f);
}

/// Throws std::runtime_error with the names that exist when there is no such robot.
template <class F>
void for_robot(const std::string& name, F&& f) {
  if (!with_robot(name, f)) throw std::runtime_error("no robot '" + name + "'; there are: " + std::string(kRobotNames));
}
/// Throws std::runtime_error where a robot that makes its map has no ids for it.
template <class Estimators>
void require_map_ids(const std::string& name, std::uint32_t can_base) {
  if (!Estimators::kMakesMap || param::has_map_ids(can_base)) return;
  std::array<char, 16> hex{};
  std::snprintf(hex.data(), hex.size(), "0x%X", static_cast<unsigned>(can_base));
  throw std::runtime_error("robot " + name + ": can_base is " + hex.data() + "; it has to be " + param::kMapIdsRule);
}
/// The same with these settings over the robot's parameters.
template <class F>
void for_robot(const std::string& name, const ParameterSettings& settings, F&& f) {
  for_robot(name,
            [&]<class Estimators>(std::type_identity<Estimators> estimators, const param::Parameters& parameters) {
              const param::Parameters stated = settings.over(parameters);
              require_map_ids<Estimators>(name, stated.can_base);
              f(estimators, stated);
            });
}

[[nodiscard]] inline param::Parameters parameters_of(const std::string& robot, const ParameterSettings& settings = {}) {
  param::Parameters found;
  for_robot(robot, settings, [&found](auto, const param::Parameters& parameters) { found = parameters; });
  return found;
}

}  // namespace tetap::sim
