// SPDX-License-Identifier: Apache-2.0
// Reset and clock control with power scale and flash wait states: the clock tree of the STM32F412. RM0402 chapters
// "Reset and clock control", "Power controller" and "Embedded flash memory interface". Limits and start-up times are
// from the data sheet DS11139 (tables of general operating conditions, HSE, HSI, LSI and PLL characteristics).
#pragma once

#include "sim_host/emulator/clock_controller.hpp"

#include <cstdint>
#include <functional>

namespace tetap::board {

class Pwr;
class FlashF4;

class Rcc final : public ClockController {
 public:
  Rcc(Surroundings around, const Oscillators& oscillators, const Pwr& pwr, const FlashF4& flash);

  std::uint32_t read(std::uint32_t offset) override;
  void write(std::uint32_t offset, std::uint32_t value, std::uint32_t mask) override;
  /// System reset: everything but the reset flags.
  void reset() override;
  void add_reset_flags(ResetCause cause) override;

  [[nodiscard]] std::int64_t sysclk_hz() const;
  [[nodiscard]] std::int64_t hclk_hz() const override { return sysclk_hz() >> hclk_shift_; }
  [[nodiscard]] std::int64_t apb1_hz() const { return hclk_hz() >> apb1_shift_; }
  [[nodiscard]] std::int64_t apb2_hz() const { return hclk_hz() >> apb2_shift_; }
  /// Clock of the timers on APB1: doubled where the bus is divided (DCKCFGR.TIMPRE = 0).
  [[nodiscard]] std::int64_t apb1_timer_hz() const { return apb1_shift_ == 0 ? apb1_hz() : 2 * apb1_hz(); }
  [[nodiscard]] std::int64_t lsi_hz() const { return oscillators_.lsi_hz; }
  [[nodiscard]] bool pll_on() const;

  /// Complains where core, buses and flash are faster than they may be; called after each change.
  void check_limits();

 private:
  [[nodiscard]] std::int64_t pll_hz() const;
  void write_cr(std::uint32_t value);
  void write_cfgr(std::uint32_t value);
  void check_pll();
  void oscillators_ready();
  void plan_buses();

  Oscillators oscillators_;
  const Pwr& pwr_;
  const FlashF4& flash_;
  Alarm hse_ready_, pll_ready_, lsi_ready_;
  int hclk_shift_ = 0, apb1_shift_ = 0, apb2_shift_ = 0;
};

/// PWR_CR.VOS: how fast the core may run.
class Pwr final : public Peripheral {
 public:
  explicit Pwr(Surroundings around);
  std::uint32_t read(std::uint32_t offset) override;
  void write(std::uint32_t offset, std::uint32_t value, std::uint32_t mask) override;
  void reset() override;
  /// Fastest HCLK of the voltage scale: 100, 84 or 64 MHz.
  [[nodiscard]] std::int64_t limit_hz() const;

 private:
  std::uint32_t cr_ = 0;
};

}  // namespace tetap::board
