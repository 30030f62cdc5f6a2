// SPDX-License-Identifier: Apache-2.0
// Clocks of the blocks on one bus of an STM32. RM0402 and RM0440, chapter "Reset and clock control (RCC)".
#pragma once

#include "hal/chip/support/register_steps.hpp"

#include <cstdint>

namespace tetap::hal::stm32 {

/// A bus's two registers of RCC, and the bits of its blocks in them.
struct PeripheralClocks {
  std::uint32_t enable_offset, enabled, reset_offset, reset;
};

/// Each block is reset, whatever a boot loader left.
template <class Registers>
void start(Registers rcc, const PeripheralClocks& bus) {
  set_bits(rcc, bus.enable_offset, bus.enabled);
  rcc.write(bus.reset_offset, bus.reset);
  rcc.write(bus.reset_offset, 0);
  // "Delay after an RCC peripheral clock enabling": two clocks of the bus.
  static_cast<void>(rcc.read(bus.reset_offset));
}

}  // namespace tetap::hal::stm32
