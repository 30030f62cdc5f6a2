// SPDX-License-Identifier: Apache-2.0
// The PLL of the STM32G474, and what its clock asks of regulator, flash and buses. RM0440 chapters "Power control
// (PWR)", "Reset and clock control (RCC)", "Embedded flash memory (FLASH)"; limits: data sheet DS12288, tables "General
// operating conditions", "PLL characteristics".
#pragma once

#include "hal/chip/stm32/clock_source.hpp"
#include "hal/chip/stm32/registers_stm32g474.hpp"
#include "hal/chip/support/register_steps.hpp"

#include <cstdint>

namespace tetap::hal::stm32 {

/// The PLL's factors: input / m * n / 2. Core and both peripheral buses have its clock.
struct G4PllPlan {
  static constexpr std::uint32_t kInternal_hz = 16'000'000;
  static constexpr std::uint32_t kInput_hz = 4'000'000;  ///< input of the VCO
  static constexpr std::uint32_t kDivider = 2;           ///< R
  static constexpr Field kInternalOn = stm32g474::rcc::cr::kHsion, kInternalReady = stm32g474::rcc::cr::kHsirdy,
                         kLatency = stm32g474::flash::acr::kLatency;
  static constexpr std::uint32_t kFactors = stm32g474::rcc::pllcfgr::kOffset;
  /// RCC_CFGR.SW and SWS.
  static constexpr std::uint32_t kOnInternal = 1, kOnPll = 3;
  /// RCC_CFGR.HPRE: the core's clock is divided by 2 at the switch.
  static constexpr std::uint32_t kDividers = stm32g474::rcc::cfgr::kHpre(8);
  /// FLASH_ACR.LATENCY in range 1 boost: 136 to 170 MHz.
  static constexpr std::uint32_t kWaitStates = 4;

  std::uint32_t crystal_hz = 0;
  std::uint32_t core_hz = 0;

  [[nodiscard]] constexpr std::uint32_t apb1_hz() const { return core_hz; }
  [[nodiscard]] constexpr std::uint32_t wait_states() const { return kWaitStates; }
  [[nodiscard]] constexpr std::uint32_t n() const { return core_hz * kDivider / kInput_hz; }
  /// In range 1 boost with 4 wait states: 136 to 170 MHz; the VCO from 96 to 344 MHz.
  [[nodiscard]] constexpr bool valid() const {
    return crystal_hz >= 4'000'000 && crystal_hz <= 48'000'000 && crystal_hz % kInput_hz == 0 &&
           crystal_hz / kInput_hz <= 16 && core_hz > 136'000'000 && core_hz <= 170'000'000 &&
           core_hz * kDivider % kInput_hz == 0 && n() >= 8 && n() <= 127;
  }
  [[nodiscard]] constexpr std::uint32_t factors(ClockSource source) const {
    namespace pll = stm32g474::rcc::pllcfgr;
    constexpr std::uint32_t kFromInternal = 2, kFromCrystal = 3;
    const bool crystal = source == ClockSource::kCrystal;
    return pll::kPllsrc(crystal ? kFromCrystal : kFromInternal) |
           pll::kPllm((crystal ? crystal_hz : kInternal_hz) / kInput_hz - 1) | pll::kPlln(n()) |
           pll::kPllr(kDivider / 2 - 1) | pll::kPllren.mask();
  }

  template <class Registers>
  void before_lock(Registers rcc, Registers /*pwr*/) const {
    namespace apb1enr1 = stm32g474::rcc::apb1enr1;
    set_bits(rcc, apb1enr1::kOffset, apb1enr1::kPwren.mask());
    static_cast<void>(rcc.read(apb1enr1::kOffset));  // the enabled block answers two clocks later
  }
  /// Range 1 with R1MODE = 0, which 150 MHz and more need.
  template <class Registers>
  [[nodiscard]] bool after_lock(Registers pwr) const {
    namespace reg = stm32g474::pwr;
    constexpr std::uint32_t kRange1 = 1;
    pwr.write(reg::cr1::kOffset, reg::cr1::kVos.in(pwr.read(reg::cr1::kOffset), kRange1));
    clear_bits(pwr, reg::cr5::kOffset, reg::cr5::kR1mode.mask());
    return waits_for(pwr, reg::sr2::kOffset, reg::sr2::kVosf, 0, kClockPatience);
  }
  /// "Range 1 boost mode": the core runs at half of the clock for a microsecond and more after the switch.
  template <class Registers>
  void after_switch(Registers rcc) const {
    namespace cfgr = stm32g474::rcc::cfgr;
    constexpr int kMicrosecond = 200;  // reads of two clocks and more at 80 MHz: 5 us
    for (int i = 0; i < kMicrosecond; ++i) static_cast<void>(rcc.read(cfgr::kOffset));
    rcc.write(cfgr::kOffset, cfgr::kSw(kOnPll));
  }
};

}  // namespace tetap::hal::stm32
