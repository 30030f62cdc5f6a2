// SPDX-License-Identifier: Apache-2.0
#include "sim_host/in_process.hpp"

#include "sim_host/robots.hpp"
#include "version.hpp"

#include <memory>

namespace tetap::sim {

int with_node_in_process(const std::string& robot, const ParameterSettings& settings, std::uint32_t can_base,
                         const std::function<int(InProcessLink&)>& play) {
  const Robot& chosen = robot_named(robot);
  param::Parameters parameters = parameters_of(robot, settings);
  parameters.can_base = can_base;
  // A node in the player's own process is the player's.
  if (parameters.loop.lockstep == param::Lockstep::kAuthenticated) parameters.loop.lockstep = param::Lockstep::kPlain;
  require_map_ids(chosen, can_base);
  hal::MemoryBus bus;
  hal::MemoryCan node_end = bus.node_end();
  CanAdapter can(node_end);
  constexpr base::Micros kLongestPause{200'000};  // well below the time after which lockstep ends
  HostBoard board(can, kLongestPause);
  const std::unique_ptr<RobotFirmware> firmware = chosen.make_firmware(board, parameters, version());
  InProcessLink link(bus, [&firmware] { firmware->poll(); });
  link.on_resume([&firmware](std::span<const std::byte> state) { return firmware->resume(state); });
  return play(link);
}

}  // namespace tetap::sim
