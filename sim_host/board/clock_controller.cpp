// SPDX-License-Identifier: Apache-2.0
#include "sim_host/board/clock_controller.hpp"

namespace tetap::board {

void ClockController::write_gate(std::uint32_t offset, std::uint32_t merged) {
  const std::uint32_t before = word(offset);
  word(offset) = merged;
  for (const Block& block : blocks_) {
    const bool pulse = block.reset_offset == offset && (merged & block.reset_mask) != 0;
    if (pulse && (before & block.reset_mask) == 0) block.peripheral->reset();
  }
}

bool ClockController::clocked(const Peripheral& block) const {
  for (const Block& one : blocks_) {
    if (one.peripheral != &block) continue;
    const bool held = one.reset_mask != 0 && (word(one.reset_offset) & one.reset_mask) != 0;
    return !held && (one.enable_mask == 0 || (word(one.enable_offset) & one.enable_mask) != 0);
  }
  return true;
}

}  // namespace tetap::board
