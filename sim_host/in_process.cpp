// SPDX-License-Identifier: Apache-2.0
#include "sim_host/in_process.hpp"

#include "sim_host/robots.hpp"
#include "version.hpp"

namespace tetap::sim {

int with_node_in_process(const std::string& robot, const ParameterSettings& settings, std::uint32_t can_base,
                         const std::function<int(InProcessLink&)>& play) {
  const Robot& chosen = robot_named(robot);
  const param::Parameters parameters = MemoryNode::for_player(parameters_of(robot, settings), can_base);
  require_map_ids(chosen, can_base);
  MemoryNode node(chosen, parameters, version());
  return play(node.link());
}

}  // namespace tetap::sim
