// SPDX-License-Identifier: Apache-2.0
// Words of the flash itself, for its drivers. A write has left the core's buffer before the controller is asked about
// it: the flash is normal memory, its controller a device.
#pragma once

#include "hal/chip/support/mmio.hpp"

#include <cstdint>

extern "C" {
// NOLINTNEXTLINE(bugprone-reserved-identifier): link.ld makes this name
extern std::uint32_t __kept_start[];  ///< begin of the flash that no image lies in
}

namespace tetap::hal::stm32 {

struct FlashCells {
  Mmio words;

  [[nodiscard]] std::uint32_t read(std::uint32_t offset) const { return words.read(offset); }
  void write(std::uint32_t offset, std::uint32_t value) const {
    words.write(offset, value);
    asm volatile("dsb" ::: "memory");
  }
};

[[nodiscard]] inline FlashCells kept_cells() { return {Mmio{reinterpret_cast<std::uintptr_t>(__kept_start)}}; }

}  // namespace tetap::hal::stm32
