// SPDX-License-Identifier: Apache-2.0
// A node in the player's own process: the same frames, codec and firmware as on a bus, without the bus.
#pragma once

#include "sim_host/parameter_settings.hpp"
#include "sim_host/replay/memory_node.hpp"

#include <cstdint>
#include <functional>
#include <string>

namespace tetap::sim {

/// Calls play(link) with a link to a node of that robot, with these settings, in this process; its status. Throws
/// std::runtime_error when there is no such robot.
int with_node_in_process(const std::string& robot, const ParameterSettings& settings, std::uint32_t can_base,
                         const std::function<int(InProcessLink&)>& play);

}  // namespace tetap::sim
