// SPDX-License-Identifier: Apache-2.0
// Clocks that an STM32 came up with.
#pragma once

#include <cstdint>

namespace tetap::hal::stm32 {

enum class ClockSource : std::uint8_t {
  kCrystal,
  kInternal,       ///< HSI through the PLL: 1 % off, too much for CAN at 500 kbit/s over all temperatures
  kInternalDirect  ///< HSI without the PLL, which did not lock
};

struct Clocks {
  ClockSource source = ClockSource::kInternalDirect;
  std::uint32_t core_hz = 0;
  std::uint32_t apb1_hz = 0;
  std::uint32_t apb2_hz = 0;
};

/// Reads at 16 MHz, some 0.6 us each, until a clock or the regulator must be ready: 1.2 ms, and a PLL needs 0.3.
inline constexpr int kClockPatience = 2'000;

}  // namespace tetap::hal::stm32
