// SPDX-License-Identifier: Apache-2.0
// Start of an STM32's clocks: the crystal through the PLL, or the internal oscillator through the same PLL when the
// crystal does not start. RM0402, RM0090 and RM0440, chapter "Reset and clock control (RCC)". The registers are those
// of the F4; where the G4's differ, its plan names them, and a test holds that the others are the same.
#pragma once

#include "hal/chip/stm32/clock_source.hpp"
#include "hal/chip/stm32/registers_stm32f412.hpp"
#include "hal/chip/support/register_steps.hpp"

namespace tetap::hal::stm32 {

namespace cr = stm32f412::rcc::cr;
namespace cfgr = stm32f412::rcc::cfgr;

/// Starts the clocks of an F4PllPlan or a G4PllPlan. Every wait is bounded.
template <class Registers>
class ClockTree {
 public:
  constexpr ClockTree(Registers rcc, Registers pwr, Registers flash) : rcc_{rcc}, pwr_{pwr}, flash_{flash} {}

  template <class Plan>
  [[nodiscard]] Clocks start(const Plan& plan) const {
    on_internal_oscillator(plan);
    set_bits(rcc_, cr::kOffset, cr::kHseon.mask());
    const bool crystal = waits_for(rcc_, cr::kOffset, cr::kHserdy, 1, kCrystalPatience);
    if (!crystal) clear_bits(rcc_, cr::kOffset, cr::kHseon.mask());
    if (crystal && lock(plan, ClockSource::kCrystal)) return running(plan, ClockSource::kCrystal);
    if (lock(plan, ClockSource::kInternal)) return running(plan, ClockSource::kInternal);
    clear_bits(rcc_, cr::kOffset, cr::kPllon.mask());
    return {.source = ClockSource::kInternalDirect,
            .core_hz = Plan::kInternal_hz,
            .apb1_hz = Plan::kInternal_hz,
            .apb2_hz = Plan::kInternal_hz};
  }

 private:
  // Reads at 16 MHz, some 0.6 us each: 30 ms for a crystal, whose start lasts 2 ms.
  static constexpr int kCrystalPatience = 50'000;

  /// As after a reset, whatever a boot loader left.
  template <class Plan>
  void on_internal_oscillator(const Plan& /*plan*/) const {
    set_bits(rcc_, cr::kOffset, Plan::kInternalOn.mask());
    static_cast<void>(waits_for(rcc_, cr::kOffset, Plan::kInternalReady, 1, kClockPatience));
    rcc_.write(cfgr::kOffset, cfgr::kSw(Plan::kOnInternal));
    static_cast<void>(waits_for(rcc_, cfgr::kOffset, cfgr::kSws, Plan::kOnInternal, kClockPatience));
    clear_bits(rcc_, cr::kOffset, cr::kPllon.mask() | cr::kCsson.mask());
    static_cast<void>(waits_for(rcc_, cr::kOffset, cr::kPllrdy, 0, kClockPatience));
    clear_bits(rcc_, cr::kOffset, cr::kHseon.mask() | cr::kHsebyp.mask());
  }

  template <class Plan>
  [[nodiscard]] bool lock(const Plan& plan, ClockSource source) const {
    clear_bits(rcc_, cr::kOffset, cr::kPllon.mask());
    static_cast<void>(waits_for(rcc_, cr::kOffset, cr::kPllrdy, 0, kClockPatience));
    plan.before_lock(rcc_, pwr_);
    rcc_.write(Plan::kFactors, plan.factors(source));
    set_bits(rcc_, cr::kOffset, cr::kPllon.mask());
    return waits_for(rcc_, cr::kOffset, cr::kPllrdy, 1, kClockPatience) && plan.after_lock(pwr_);
  }

  /// Wait states and dividers stand before the clock is switched.
  template <class Plan>
  [[nodiscard]] Clocks running(const Plan& plan, ClockSource source) const {
    namespace acr = stm32f412::flash::acr;
    flash_.write(acr::kOffset,
                 Plan::kLatency(plan.wait_states()) | acr::kPrften.mask() | acr::kIcen.mask() | acr::kDcen.mask());
    static_cast<void>(waits_for(flash_, acr::kOffset, Plan::kLatency, plan.wait_states(), kClockPatience));
    rcc_.write(cfgr::kOffset, cfgr::kSw(Plan::kOnInternal) | Plan::kDividers);
    rcc_.write(cfgr::kOffset, cfgr::kSw(Plan::kOnPll) | Plan::kDividers);
    static_cast<void>(waits_for(rcc_, cfgr::kOffset, cfgr::kSws, Plan::kOnPll, kClockPatience));
    plan.after_switch(rcc_);
    // A crystal that stops later is an NMI and a reset instead of a core without a clock.
    if (source == ClockSource::kCrystal) set_bits(rcc_, cr::kOffset, cr::kCsson.mask());
    return {.source = source, .core_hz = plan.core_hz, .apb1_hz = plan.apb1_hz(), .apb2_hz = plan.core_hz};
  }

  Registers rcc_, pwr_, flash_;
};

}  // namespace tetap::hal::stm32
