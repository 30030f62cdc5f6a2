// SPDX-License-Identifier: Apache-2.0
// A node in the player's own process: the same frames, codec and firmware as on a bus, without the bus.
#pragma once

#include "app/firmware.hpp"
#include "hal/port/linux/memory_can.hpp"
#include "sim_host/play/link.hpp"
#include "sim_host/robots.hpp"
#include "version.hpp"

#include <memory>
#include <string>

namespace tetap::sim {

/// Calls play(link) with a link to a node of that robot in this process; its status.
template <class Play>
int with_node_in_process(const std::string& robot, std::uint32_t can_base, Play&& play) {
  int status = 2;
  for_robot(robot, [&]<class Estimators>(std::type_identity<Estimators>, app::Numbers numbers) {
    numbers.can_base = can_base;
    hal::MemoryBus bus;
    hal::MemoryBoard board(bus);
    const auto firmware = std::make_unique<app::Firmware<hal::MemoryBoard, Estimators>>(board, numbers, kVersion);
    MemoryLink link(bus, [&firmware] { firmware->poll(); });
    status = play(link);
  });
  return status;
}

}  // namespace tetap::sim
