// SPDX-License-Identifier: Apache-2.0
#include "sim_host/emulator/clock_controller.hpp"

#include <algorithm>

namespace tetap::board {

void ClockController::write_gate(std::uint32_t offset, std::uint32_t merged) {
  const std::uint32_t before = word(offset);
  word(offset) = merged;
  for (const Block& block : blocks_) {
    const bool pulse = block.reset_offset == offset && (merged & block.reset_mask) != 0;
    if (pulse && (before & block.reset_mask) == 0) block.peripheral->reset();
  }
}

// A polling loop asks for one block again and again.
bool ClockController::clocked(const Peripheral& block) const {
  if (last_asked_ >= blocks_.size() || blocks_[last_asked_].peripheral != &block) {
    const auto found =
        std::find_if(blocks_.begin(), blocks_.end(), [&block](const Block& one) { return one.peripheral == &block; });
    if (found == blocks_.end()) return true;
    last_asked_ = static_cast<std::size_t>(found - blocks_.begin());
  }
  const Block& one = blocks_[last_asked_];
  const bool held = one.reset_mask != 0 && (word(one.reset_offset) & one.reset_mask) != 0;
  return !held && (one.enable_mask == 0 || (word(one.enable_offset) & one.enable_mask) != 0);
}

}  // namespace tetap::board
