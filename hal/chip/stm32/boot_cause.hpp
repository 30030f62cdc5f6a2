// SPDX-License-Identifier: Apache-2.0
// Cause of the last reset. RM0402 chapter "Reset and clock control (RCC)", register RCC_CSR: flags add up until RMVF
// clears them. Every reset also sets PINRST, because the chip drives its own reset pin.
#pragma once

#include "hal/board_report.hpp"
#include "hal/chip/stm32/registers_stm32f412.hpp"

#include <cstdint>

namespace tetap::hal::stm32 {

/// From RCC_CSR as it was at start. A power-on sets the flag of the brown-out reset, too.
[[nodiscard]] constexpr BootCause boot_cause(std::uint32_t csr) {
  namespace flag = stm32f412::rcc::csr;
  if (flag::kPorrstf.of(csr) != 0) return BootCause::kPowerOn;
  if (flag::kLpwrrstf.of(csr) != 0) return BootCause::kLowPower;
  if ((csr & (flag::kWdgrstf.mask() | flag::kWwdgrstf.mask())) != 0) return BootCause::kWatchdog;
  if (flag::kSftrstf.of(csr) != 0) return BootCause::kSoftware;
  if (flag::kBorrstf.of(csr) != 0) return BootCause::kBrownOut;
  if (flag::kPadrstf.of(csr) != 0) return BootCause::kPin;
  return BootCause::kUnknown;
}

/// Reads the cause and clears the flags for the next reset.
template <class Registers>
[[nodiscard]] BootCause take_boot_cause(Registers rcc) {
  namespace csr = stm32f412::rcc::csr;
  const std::uint32_t value = rcc.read(csr::kOffset);
  rcc.write(csr::kOffset, value | csr::kRmvf.mask());
  return boot_cause(value);
}

}  // namespace tetap::hal::stm32
