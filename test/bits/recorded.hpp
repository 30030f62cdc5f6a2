// SPDX-License-Identifier: Apache-2.0
// A recorded input as an array: frames, and after how many of them the node ticks.
#pragma once

#include "tetap/base/can_frame.hpp"

#include <cstdint>

// The Cortex-R5's tightly coupled memory has no room for the record beside the program; there it lies in a section of
// its own.
#if defined(TETAP_BOARD_ZYNQMP_R5)
#define TETAP_RECORDED [[gnu::section(".recorded")]]
#else
#define TETAP_RECORDED
#endif

namespace tetap::bits {

struct RecordedFrame {
  std::uint8_t offset;  ///< within the node's block
  std::uint8_t size;
  std::uint8_t data[8];

  [[nodiscard]] base::CanFrame frame(std::uint32_t can_base) const {
    base::CanFrame f{.id = can_base + offset, .size = size};
    for (std::size_t i = 0; i < 8; ++i) f.data[i] = data[i];
    return f;
  }
};

struct RecordedTick {
  std::int32_t time_us;
  std::uint32_t frames;  ///< frames that arrive before it
};

}  // namespace tetap::bits
