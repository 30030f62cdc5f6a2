// SPDX-License-Identifier: Apache-2.0
// Cause of the last reset. RM0402 and RM0440, chapter "Reset and clock control (RCC)", register RCC_CSR: flags add up
// until RMVF clears them. Every reset also sets PINRST, because the chip drives its own reset pin.
#pragma once

#include "hal/board_report.hpp"
#include "hal/chip/stm32/registers_stm32f412.hpp"
#include "hal/chip/stm32/registers_stm32g474.hpp"

#include <cstdint>

namespace tetap::hal::stm32 {

/// Place of RCC_CSR, and its flags; 0: the chip has no such flag.
struct ResetFlags {
  std::uint32_t offset, clear, power_on, low_power, watchdog, software, brown_out, pin;
};

inline constexpr ResetFlags kResetFlagsF4 = [] {
  namespace csr = stm32f412::rcc::csr;
  return ResetFlags{.offset = csr::kOffset,
                    .clear = csr::kRmvf.mask(),
                    .power_on = csr::kPorrstf.mask(),
                    .low_power = csr::kLpwrrstf.mask(),
                    .watchdog = csr::kWdgrstf.mask() | csr::kWwdgrstf.mask(),
                    .software = csr::kSftrstf.mask(),
                    .brown_out = csr::kBorrstf.mask(),
                    .pin = csr::kPadrstf.mask()};
}();

/// One flag stands for power-on and brown-out.
inline constexpr ResetFlags kResetFlagsG4 = [] {
  namespace csr = stm32g474::rcc::csr;
  return ResetFlags{.offset = csr::kOffset,
                    .clear = csr::kRmvf.mask(),
                    .power_on = csr::kBorrstf.mask(),
                    .low_power = csr::kLpwrrstf.mask(),
                    .watchdog = csr::kIwdgrstf.mask() | csr::kWwdgrstf.mask(),
                    .software = csr::kSftrstf.mask(),
                    .brown_out = 0,
                    .pin = csr::kPinrstf.mask()};
}();

/// From RCC_CSR as it was at start. A power-on sets the flag of the brown-out reset, too.
[[nodiscard]] constexpr BootCause boot_cause(std::uint32_t csr, const ResetFlags& flags = kResetFlagsF4) {
  if ((csr & flags.power_on) != 0) return BootCause::kPowerOn;
  if ((csr & flags.low_power) != 0) return BootCause::kLowPower;
  if ((csr & flags.watchdog) != 0) return BootCause::kWatchdog;
  if ((csr & flags.software) != 0) return BootCause::kSoftware;
  if ((csr & flags.brown_out) != 0) return BootCause::kBrownOut;
  if ((csr & flags.pin) != 0) return BootCause::kPin;
  return BootCause::kUnknown;
}

/// Reads the cause and clears the flags for the next reset.
template <class Registers>
[[nodiscard]] BootCause take_boot_cause(Registers rcc, const ResetFlags& flags = kResetFlagsF4) {
  const std::uint32_t value = rcc.read(flags.offset);
  rcc.write(flags.offset, value | flags.clear);
  return boot_cause(value, flags);
}

}  // namespace tetap::hal::stm32
