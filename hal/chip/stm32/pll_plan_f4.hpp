// SPDX-License-Identifier: Apache-2.0
// The PLL of the STM32F412 and STM32F405, and what its clock asks of regulator, flash and buses. RM0402 and RM0090,
// chapters "Reset and clock control (RCC)", "Power controller (PWR)", "Embedded flash memory interface"; limits: data
// sheets DS11139 and DS8626, tables "General operating conditions", "Main PLL characteristics".
#pragma once

#include "hal/chip/stm32/clock_source.hpp"
#include "hal/chip/stm32/registers_stm32f412.hpp"
#include "hal/chip/support/register_steps.hpp"

#include <cstdint>

namespace tetap::hal::stm32 {

/// Clocks that a chip takes with its fixed wait states and voltage scale, at 2.7 to 3.6 V.
struct ClockLimits {
  std::uint32_t input_hz;  ///< input of the VCO, 1 or 2 MHz
  std::uint32_t above_core_hz, most_core_hz, most_apb1_hz;
  std::uint32_t wait_states;  ///< FLASH_ACR.LATENCY
  std::uint32_t scale;        ///< PWR_CR.VOS
};

/// Scale 1, which 84 MHz and more need. The manual names 2 MHz for the least jitter.
inline constexpr ClockLimits kStm32f412Clocks{.input_hz = 2'000'000,
                                              .above_core_hz = 90'000'000,
                                              .most_core_hz = 100'000'000,
                                              .most_apb1_hz = 50'000'000,
                                              .wait_states = 3,
                                              .scale = 3};
/// VOS has one bit: scale 1. An input of 1 MHz suits a crystal of 25 MHz.
inline constexpr ClockLimits kStm32f405Clocks{.input_hz = 1'000'000,
                                              .above_core_hz = 60'000'000,
                                              .most_core_hz = 90'000'000,
                                              .most_apb1_hz = 42'000'000,
                                              .wait_states = 2,
                                              .scale = 1};

/// The PLL's factors: input / m * n / p. Core and APB2 have its clock, APB1 half of it.
struct F4PllPlan {
  static constexpr std::uint32_t kInternal_hz = 16'000'000;
  static constexpr Field kInternalOn = stm32f412::rcc::cr::kHsion, kInternalReady = stm32f412::rcc::cr::kHsirdy,
                         kLatency = stm32f412::flash::acr::kLatency;
  static constexpr std::uint32_t kFactors = stm32f412::rcc::pllcfgr::kOffset;
  /// RCC_CFGR.SW and SWS.
  static constexpr std::uint32_t kOnInternal = 0, kOnPll = 2;
  /// RCC_CFGR.PPRE1: divided by 2.
  static constexpr std::uint32_t kDividers = stm32f412::rcc::cfgr::kPpre1(4);

  std::uint32_t crystal_hz = 0;
  std::uint32_t core_hz = 0;
  std::uint32_t p = 4;  ///< 2, 4, 6 or 8
  ClockLimits limits = kStm32f412Clocks;

  [[nodiscard]] constexpr std::uint32_t apb1_hz() const { return core_hz / 2; }
  [[nodiscard]] constexpr std::uint32_t wait_states() const { return limits.wait_states; }
  [[nodiscard]] constexpr std::uint32_t vco_hz() const { return core_hz * p; }
  [[nodiscard]] constexpr std::uint32_t n() const { return vco_hz() / limits.input_hz; }
  [[nodiscard]] constexpr bool valid() const {
    return crystal_hz >= 4'000'000 && crystal_hz <= 26'000'000 && crystal_hz % limits.input_hz == 0 &&
           core_hz <= limits.most_core_hz && apb1_hz() <= limits.most_apb1_hz && core_hz > limits.above_core_hz &&
           p >= 2 && p <= 8 && p % 2 == 0 && vco_hz() >= 100'000'000 && vco_hz() <= 432'000'000 &&
           vco_hz() % limits.input_hz == 0 && n() >= 50 && n() <= 432;
  }
  [[nodiscard]] constexpr std::uint32_t factors(ClockSource source) const {
    namespace pll = stm32f412::rcc::pllcfgr;
    const bool crystal = source == ClockSource::kCrystal;
    const std::uint32_t usb_divider = vco_hz() / 48'000'000;
    return pll::kPllm((crystal ? crystal_hz : kInternal_hz) / limits.input_hz) | pll::kPlln(n()) |
           pll::kPllp(p / 2 - 1) | pll::kPllsrc(crystal ? 1 : 0) | pll::kPllq(usb_divider) | pll::kPllr(2);
  }

  /// VOS can be written while the PLL is off, and takes effect when it runs.
  template <class Registers>
  void before_lock(Registers rcc, Registers pwr) const {
    namespace apb1enr = stm32f412::rcc::apb1enr;
    namespace vos = stm32f412::pwr::cr;
    set_bits(rcc, apb1enr::kOffset, apb1enr::kPwren.mask());
    static_cast<void>(rcc.read(apb1enr::kOffset));  // the enabled block answers two clocks later
    pwr.write(vos::kOffset, vos::kVos.in(pwr.read(vos::kOffset), limits.scale));
  }
  template <class Registers>
  [[nodiscard]] bool after_lock(Registers pwr) const {
    return waits_for(pwr, stm32f412::pwr::csr::kOffset, stm32f412::pwr::csr::kVosrdy, 1, kClockPatience);
  }
  template <class Registers>
  void after_switch(Registers /*rcc*/) const {}
};

}  // namespace tetap::hal::stm32
