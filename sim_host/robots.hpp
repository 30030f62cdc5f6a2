// SPDX-License-Identifier: Apache-2.0
// The robots a host program can be, chosen by name. Each is a module that is read when it is asked for, so a program
// needs only the robots that are used. (A flash image holds one.)
#pragma once

#include "sim_host/parameter_settings.hpp"
#include "sim_host/robot.hpp"

#include <cstdint>
#include <string>

namespace tetap::sim {

/// Names of all robots of config/, built or not, with a space between each; the matched ones of simulation at the end.
[[nodiscard]] const std::string& robot_names();

/// Throws std::runtime_error with the names that exist when there is no such robot, and with the command that builds it
/// where its module is not there.
[[nodiscard]] const Robot& robot_named(const std::string& name);

/// Whether that robot's module is there.
[[nodiscard]] bool is_built(const std::string& name);

/// Its parameters with these settings over them. Throws as robot_named(), and std::runtime_error where a robot that
/// makes its map has no ids for it.
[[nodiscard]] param::Parameters parameters_of(const std::string& robot, const ParameterSettings& settings = {});

/// Throws std::runtime_error where a robot that makes its map has no ids for it.
void require_map_ids(const Robot& robot, std::uint32_t can_base);

}  // namespace tetap::sim
