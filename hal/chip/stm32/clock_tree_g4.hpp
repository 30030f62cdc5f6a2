// SPDX-License-Identifier: Apache-2.0
// Clocks of the STM32G474: the crystal through the PLL, or the internal oscillator through the same PLL when the
// crystal does not start. RM0440 chapters "Power control (PWR)", "Reset and clock control (RCC)", "Embedded flash
// memory (FLASH)"; limits: data sheet DS12288, tables "General operating conditions", "PLL characteristics".
#pragma once

#include "hal/chip/stm32/clock_source.hpp"
#include "hal/chip/stm32/registers_stm32g474.hpp"
#include "hal/chip/support/register_steps.hpp"

#include <cstdint>

namespace tetap::hal::stm32 {

namespace g4 {
namespace cr = stm32g474::rcc::cr;
namespace cfgr = stm32g474::rcc::cfgr;
namespace apb1enr1 = stm32g474::rcc::apb1enr1;

/// The PLL's factors: input / m * n / 2.
struct PllPlan {
  static constexpr std::uint32_t kInternal_hz = 16'000'000;
  static constexpr std::uint32_t kInput_hz = 4'000'000;  ///< input of the VCO
  static constexpr std::uint32_t kDivider = 2;           ///< R

  std::uint32_t crystal_hz = 0;
  std::uint32_t core_hz = 0;

  [[nodiscard]] constexpr std::uint32_t n() const { return core_hz * kDivider / kInput_hz; }
  /// In range 1 boost with 4 wait states: 136 to 170 MHz; the VCO from 96 to 344 MHz.
  [[nodiscard]] constexpr bool valid() const {
    return crystal_hz >= 4'000'000 && crystal_hz <= 48'000'000 && crystal_hz % kInput_hz == 0 &&
           crystal_hz / kInput_hz <= 16 && core_hz > 136'000'000 && core_hz <= 170'000'000 &&
           core_hz * kDivider % kInput_hz == 0 && n() >= 8 && n() <= 127;
  }
  [[nodiscard]] constexpr std::uint32_t pllcfgr(ClockSource source) const {
    namespace pll = stm32g474::rcc::pllcfgr;
    constexpr std::uint32_t kFromInternal = 2, kFromCrystal = 3;
    const bool crystal = source == ClockSource::kCrystal;
    return pll::kPllsrc(crystal ? kFromCrystal : kFromInternal) |
           pll::kPllm((crystal ? crystal_hz : kInternal_hz) / kInput_hz - 1) | pll::kPlln(n()) |
           pll::kPllr(kDivider / 2 - 1) | pll::kPllren.mask();
  }
};

/// Starts the clocks: core_hz on the core and both peripheral buses. Every wait is bounded.
template <class Registers>
class ClockTree {
 public:
  constexpr ClockTree(Registers rcc, Registers pwr, Registers flash) : rcc_{rcc}, pwr_{pwr}, flash_{flash} {}

  [[nodiscard]] Clocks start(const PllPlan& plan) const {
    on_internal_oscillator();
    set_bits(rcc_, cr::kOffset, cr::kHseon.mask());
    const bool crystal = waits_for(rcc_, cr::kOffset, cr::kHserdy, 1, kCrystalPatience);
    if (!crystal) clear_bits(rcc_, cr::kOffset, cr::kHseon.mask());
    if (crystal && lock(plan, ClockSource::kCrystal)) return running(plan, ClockSource::kCrystal);
    if (lock(plan, ClockSource::kInternal)) return running(plan, ClockSource::kInternal);
    clear_bits(rcc_, cr::kOffset, cr::kPllon.mask());
    return {.source = ClockSource::kInternalDirect,
            .core_hz = PllPlan::kInternal_hz,
            .apb1_hz = PllPlan::kInternal_hz,
            .apb2_hz = PllPlan::kInternal_hz};
  }

 private:
  // Reads at 16 MHz, some 0.6 us each: 30 ms for a crystal, whose start lasts 2 ms; 1.2 ms for the PLL and the
  // regulator.
  static constexpr int kCrystalPatience = 50'000;
  static constexpr int kPatience = 2'000;
  /// PWR_CR1.VOS: range 1.
  static constexpr std::uint32_t kRange1 = 1;
  /// FLASH_ACR.LATENCY in range 1 boost: 136 to 170 MHz.
  static constexpr std::uint32_t kWaitStates = 4;
  /// RCC_CFGR.SW and SWS.
  static constexpr std::uint32_t kOnInternal = 1, kOnPll = 3;
  /// RCC_CFGR.HPRE: divided by 2.
  static constexpr std::uint32_t kHalf = 8;

  /// As after a reset, whatever a boot loader left.
  void on_internal_oscillator() const {
    set_bits(rcc_, cr::kOffset, cr::kHsion.mask());
    static_cast<void>(waits_for(rcc_, cr::kOffset, cr::kHsirdy, 1, kPatience));
    rcc_.write(cfgr::kOffset, cfgr::kSw(kOnInternal));
    static_cast<void>(waits_for(rcc_, cfgr::kOffset, cfgr::kSws, kOnInternal, kPatience));
    clear_bits(rcc_, cr::kOffset, cr::kPllon.mask() | cr::kCsson.mask());
    static_cast<void>(waits_for(rcc_, cr::kOffset, cr::kPllrdy, 0, kPatience));
    clear_bits(rcc_, cr::kOffset, cr::kHseon.mask() | cr::kHsebyp.mask());
    set_bits(rcc_, apb1enr1::kOffset, apb1enr1::kPwren.mask());
    static_cast<void>(rcc_.read(apb1enr1::kOffset));  // the enabled block answers two clocks later
  }

  [[nodiscard]] bool lock(const PllPlan& plan, ClockSource source) const {
    clear_bits(rcc_, cr::kOffset, cr::kPllon.mask());
    static_cast<void>(waits_for(rcc_, cr::kOffset, cr::kPllrdy, 0, kPatience));
    rcc_.write(stm32g474::rcc::pllcfgr::kOffset, plan.pllcfgr(source));
    set_bits(rcc_, cr::kOffset, cr::kPllon.mask());
    return waits_for(rcc_, cr::kOffset, cr::kPllrdy, 1, kPatience) && boosted();
  }

  /// Range 1 with R1MODE = 0, which 150 MHz and more need.
  [[nodiscard]] bool boosted() const {
    namespace pwr = stm32g474::pwr;
    pwr_.write(pwr::cr1::kOffset, pwr::cr1::kVos.in(pwr_.read(pwr::cr1::kOffset), kRange1));
    clear_bits(pwr_, pwr::cr5::kOffset, pwr::cr5::kR1mode.mask());
    return waits_for(pwr_, pwr::sr2::kOffset, pwr::sr2::kVosf, 0, kPatience);
  }

  /// "Range 1 boost mode": the core runs at half of the clock for a microsecond and more after the switch. Wait states
  /// stand before it.
  [[nodiscard]] Clocks running(const PllPlan& plan, ClockSource source) const {
    namespace acr = stm32g474::flash::acr;
    constexpr int kMicrosecond = 200;  // reads of two clocks and more at 80 MHz: 5 us
    flash_.write(acr::kOffset,
                 acr::kLatency(kWaitStates) | acr::kPrften.mask() | acr::kIcen.mask() | acr::kDcen.mask());
    static_cast<void>(waits_for(flash_, acr::kOffset, acr::kLatency, kWaitStates, kPatience));
    rcc_.write(cfgr::kOffset, cfgr::kSw(kOnInternal) | cfgr::kHpre(kHalf));
    rcc_.write(cfgr::kOffset, cfgr::kSw(kOnPll) | cfgr::kHpre(kHalf));
    static_cast<void>(waits_for(rcc_, cfgr::kOffset, cfgr::kSws, kOnPll, kPatience));
    for (int i = 0; i < kMicrosecond; ++i) static_cast<void>(rcc_.read(cfgr::kOffset));
    rcc_.write(cfgr::kOffset, cfgr::kSw(kOnPll));
    // A crystal that stops later is an NMI and a reset instead of a core without a clock.
    if (source == ClockSource::kCrystal) set_bits(rcc_, cr::kOffset, cr::kCsson.mask());
    return {.source = source, .core_hz = plan.core_hz, .apb1_hz = plan.core_hz, .apb2_hz = plan.core_hz};
  }

  Registers rcc_, pwr_, flash_;
};

}  // namespace g4

}  // namespace tetap::hal::stm32
