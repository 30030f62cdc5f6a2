// SPDX-License-Identifier: Apache-2.0
// Identifiers of a CANopen node by its id (CiA 301, predefined connection set), and node ids for which none of them is
// one of the node's own blocks.
#pragma once

#include "tetap/bus/messages.hpp"

#include <array>
#include <cstdint>

namespace tetap::firmware::canopen {

inline constexpr std::uint32_t kEmergencyIds = 0x080;
inline constexpr std::uint32_t kResponseIds = 0x580;
inline constexpr std::uint32_t kRequestIds = 0x600;
inline constexpr std::uint32_t kHeartbeatIds = 0x700;

inline constexpr std::uint8_t kMostNodeId = 127;
inline constexpr const char* kNodeIdRule =
    "from 1 to 127, with 0x080, 0x580, 0x600 and 0x700 + id outside of the 128 identifiers from can_base on";

[[nodiscard]] constexpr bool is_node_id(std::uint32_t node_id, std::uint32_t can_base) {
  bool free = node_id >= 1 && node_id <= kMostNodeId;
  for (const std::uint32_t ids : std::array{kEmergencyIds, kResponseIds, kRequestIds, kHeartbeatIds})
    free = free && ids + node_id - can_base >= 2 * bus::kBlock;  // modulo 2^32
  return free;
}

/// A node id as a constant of a board: one that is_node_id() refuses does not compile.
consteval std::uint8_t checked_node_id(std::uint8_t node_id, std::uint32_t can_base) {
  if (!is_node_id(node_id, can_base))
    __builtin_printf("the CANopen node id is %d; it has to be %s", node_id, kNodeIdRule);
  return node_id;
}

}  // namespace tetap::firmware::canopen
