// SPDX-License-Identifier: Apache-2.0
// Clocks of the STM32F412 and STM32F405: the crystal through the PLL, or the internal oscillator through the same PLL
// when the crystal does not start. RM0402 and RM0090, chapters "Reset and clock control (RCC)", "Power controller
// (PWR)", "Embedded flash memory interface"; limits: data sheets DS11139 and DS8626, tables "General operating
// conditions", "Main PLL characteristics".
#pragma once

#include "hal/chip/stm32/clock_source.hpp"
#include "hal/chip/stm32/registers_stm32f412.hpp"
#include "hal/chip/support/register_steps.hpp"

#include <cstdint>

namespace tetap::hal::stm32 {

namespace cr = stm32f412::rcc::cr;
namespace cfgr = stm32f412::rcc::cfgr;
namespace vos = stm32f412::pwr::cr;

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

/// The PLL's factors: input / m * n / p.
struct PllPlan {
  static constexpr std::uint32_t kInternal_hz = 16'000'000;

  std::uint32_t crystal_hz = 0;
  std::uint32_t core_hz = 0;
  std::uint32_t p = 4;  ///< 2, 4, 6 or 8
  ClockLimits limits = kStm32f412Clocks;

  [[nodiscard]] constexpr std::uint32_t vco_hz() const { return core_hz * p; }
  [[nodiscard]] constexpr std::uint32_t n() const { return vco_hz() / limits.input_hz; }
  [[nodiscard]] constexpr bool valid() const {
    return crystal_hz >= 4'000'000 && crystal_hz <= 26'000'000 && crystal_hz % limits.input_hz == 0 &&
           core_hz <= limits.most_core_hz && core_hz / 2 <= limits.most_apb1_hz && core_hz > limits.above_core_hz &&
           p >= 2 && p <= 8 && p % 2 == 0 && vco_hz() >= 100'000'000 && vco_hz() <= 432'000'000 &&
           vco_hz() % limits.input_hz == 0 && n() >= 50 && n() <= 432;
  }
  [[nodiscard]] constexpr std::uint32_t pllcfgr(ClockSource source) const {
    namespace pll = stm32f412::rcc::pllcfgr;
    const bool crystal = source == ClockSource::kCrystal;
    const std::uint32_t usb_divider = vco_hz() / 48'000'000;
    return pll::kPllm((crystal ? crystal_hz : kInternal_hz) / limits.input_hz) | pll::kPlln(n()) |
           pll::kPllp(p / 2 - 1) | pll::kPllsrc(crystal ? 1 : 0) | pll::kPllq(usb_divider) | pll::kPllr(2);
  }
};

/// Starts the clocks: core_hz on the core and APB2, half of it on APB1. Every wait is bounded.
template <class Registers>
class ClockTree {
 public:
  constexpr ClockTree(Registers rcc, Registers pwr, Registers flash) : rcc_{rcc}, pwr_{pwr}, flash_{flash} {}

  [[nodiscard]] Clocks start(const PllPlan& plan) const {
    on_internal_oscillator();
    set_bits(rcc_, cr::kOffset, cr::kHseon.mask());
    const bool crystal = waits_for(rcc_, cr::kOffset, cr::kHserdy, 1, kCrystalPatience);
    if (!crystal) clear_bits(rcc_, cr::kOffset, cr::kHseon.mask());
    const ClockSource source = crystal ? ClockSource::kCrystal : ClockSource::kInternal;
    if (crystal && lock(plan, source)) return running(plan, source);
    if (lock(plan, ClockSource::kInternal)) return running(plan, ClockSource::kInternal);
    clear_bits(rcc_, cr::kOffset, cr::kPllon.mask());
    return {.source = ClockSource::kInternalDirect,
            .core_hz = PllPlan::kInternal_hz,
            .apb1_hz = PllPlan::kInternal_hz,
            .apb2_hz = PllPlan::kInternal_hz};
  }

 private:
  // Reads at 16 MHz, some 0.6 us each: 30 ms for a crystal, whose start lasts 2 ms; 0.6 ms for the PLL, which needs
  // 0.3.
  static constexpr int kCrystalPatience = 50'000;
  static constexpr int kPatience = 2'000;
  /// RCC_CFGR.SW and SWS.
  static constexpr std::uint32_t kOnInternal = 0, kOnPll = 2;
  /// RCC_CFGR.PPRE1: divided by 2.
  static constexpr std::uint32_t kHalf = 4;

  /// As after a reset, whatever a boot loader left.
  void on_internal_oscillator() const {
    set_bits(rcc_, cr::kOffset, cr::kHsion.mask());
    static_cast<void>(waits_for(rcc_, cr::kOffset, cr::kHsirdy, 1, kPatience));
    rcc_.write(cfgr::kOffset, cfgr::kSw(kOnInternal));
    static_cast<void>(waits_for(rcc_, cfgr::kOffset, cfgr::kSws, kOnInternal, kPatience));
    clear_bits(rcc_, cr::kOffset, cr::kPllon.mask() | cr::kCsson.mask());
    static_cast<void>(waits_for(rcc_, cr::kOffset, cr::kPllrdy, 0, kPatience));
    clear_bits(rcc_, cr::kOffset, cr::kHseon.mask() | cr::kHsebyp.mask());
  }

  [[nodiscard]] bool lock(const PllPlan& plan, ClockSource source) const {
    clear_bits(rcc_, cr::kOffset, cr::kPllon.mask());
    static_cast<void>(waits_for(rcc_, cr::kOffset, cr::kPllrdy, 0, kPatience));
    // VOS can be written while the PLL is off, and takes effect when it runs.
    namespace apb1enr = stm32f412::rcc::apb1enr;
    set_bits(rcc_, apb1enr::kOffset, apb1enr::kPwren.mask());
    static_cast<void>(rcc_.read(apb1enr::kOffset));  // the enabled block answers two clocks later
    pwr_.write(vos::kOffset, vos::kVos.in(pwr_.read(vos::kOffset), plan.limits.scale));
    rcc_.write(stm32f412::rcc::pllcfgr::kOffset, plan.pllcfgr(source));
    set_bits(rcc_, cr::kOffset, cr::kPllon.mask());
    if (!waits_for(rcc_, cr::kOffset, cr::kPllrdy, 1, kPatience)) return false;
    return waits_for(pwr_, stm32f412::pwr::csr::kOffset, stm32f412::pwr::csr::kVosrdy, 1, kPatience);
  }

  /// Wait states and dividers stand before the clock is switched.
  [[nodiscard]] Clocks running(const PllPlan& plan, ClockSource source) const {
    namespace acr = stm32f412::flash::acr;
    flash_.write(acr::kOffset,
                 acr::kLatency(plan.limits.wait_states) | acr::kPrften.mask() | acr::kIcen.mask() | acr::kDcen.mask());
    static_cast<void>(waits_for(flash_, acr::kOffset, acr::kLatency, plan.limits.wait_states, kPatience));
    rcc_.write(cfgr::kOffset, cfgr::kSw(kOnInternal) | cfgr::kPpre1(kHalf));
    rcc_.write(cfgr::kOffset, cfgr::kSw(kOnPll) | cfgr::kPpre1(kHalf));
    static_cast<void>(waits_for(rcc_, cfgr::kOffset, cfgr::kSws, kOnPll, kPatience));
    // A crystal that stops later is an NMI and a reset instead of a core without a clock.
    if (source == ClockSource::kCrystal) set_bits(rcc_, cr::kOffset, cr::kCsson.mask());
    return {.source = source, .core_hz = plan.core_hz, .apb1_hz = plan.core_hz / 2, .apb2_hz = plan.core_hz};
  }

  Registers rcc_, pwr_, flash_;
};

}  // namespace tetap::hal::stm32
