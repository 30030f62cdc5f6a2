// SPDX-License-Identifier: Apache-2.0
// Reset and clock control of the STM32G474 with its voltage ranges and flash wait states. RM0440 chapters "Reset and
// clock control (RCC)", "Power control (PWR)" and "Embedded flash memory (FLASH)"; limits and start-up times: DS12288.
#pragma once

#include "sim_host/emulator/clock_controller.hpp"

#include <cstdint>
#include <functional>

namespace tetap::board {

class FlashG4;

/// PWR_CR1.VOS and PWR_CR5.R1MODE: how fast the core may run. RM0440, "Dynamic voltage scaling management".
class PwrG4 final : public Peripheral {
 public:
  explicit PwrG4(Surroundings around);
  std::uint32_t read(std::uint32_t offset) override;
  void write(std::uint32_t offset, std::uint32_t value, std::uint32_t mask) override;
  void reset() override;

  enum class Range : std::uint8_t { kBoost, kNormal, kLow };
  [[nodiscard]] Range range() const;
  [[nodiscard]] std::int64_t limit_hz() const;
  /// PWR_CR3.UCPD1_DBDIS = 0: PB4 and PB6 have the pull-down of a USB Type-C port without supply.
  [[nodiscard]] bool dead_battery_pull_down() const;
  std::function<void()> on_change;

 private:
  std::uint32_t cr1_ = 0, cr3_ = 0, cr5_ = 0;
};

class RccG4 final : public ClockController {
 public:
  RccG4(Surroundings around, const Oscillators& oscillators, const PwrG4& pwr, const FlashG4& flash);

  std::uint32_t read(std::uint32_t offset) override;
  void write(std::uint32_t offset, std::uint32_t value, std::uint32_t mask) override;
  /// System reset: everything but the reset flags.
  void reset() override;
  void add_reset_flags(ResetCause cause) override;

  [[nodiscard]] std::int64_t sysclk_hz() const;
  [[nodiscard]] std::int64_t hclk_hz() const override { return sysclk_hz() >> hclk_shift_; }
  [[nodiscard]] std::int64_t apb1_hz() const { return hclk_hz() >> apb1_shift_; }
  [[nodiscard]] std::int64_t apb2_hz() const { return hclk_hz() >> apb2_shift_; }
  /// Clock of the timers on APB1: doubled where the bus is divided.
  [[nodiscard]] std::int64_t apb1_timer_hz() const { return apb1_shift_ == 0 ? apb1_hz() : 2 * apb1_hz(); }
  [[nodiscard]] std::int64_t lsi_hz() const { return oscillators_.lsi_hz; }
  /// Kernel clocks by CCIPR; 0: the source that is selected does not run.
  [[nodiscard]] std::int64_t usart1_hz() const;
  [[nodiscard]] std::int64_t usart2_hz() const;
  [[nodiscard]] std::int64_t fdcan_hz() const;

  /// Complains where core and flash are faster than they may be; called after each change.
  void check_limits();

 private:
  [[nodiscard]] std::int64_t vco_hz() const;
  [[nodiscard]] bool pll_on() const;
  [[nodiscard]] bool pll_ready() const;
  [[nodiscard]] bool hse_ready() const;
  [[nodiscard]] std::int64_t usart_hz(std::uint32_t select, std::int64_t bus_hz) const;
  void write_cr(std::uint32_t value);
  void write_hsi(std::uint32_t value);
  void write_cfgr(std::uint32_t value);
  void write_pllcfgr(std::uint32_t value);
  void write_csr(std::uint32_t value);
  void check_pll();
  void check_step(std::int64_t before, bool source_changed);
  void plan_buses();

  Oscillators oscillators_;
  const PwrG4& pwr_;
  const FlashG4& flash_;
  Alarm hse_ready_, pll_ready_, lsi_ready_;
  int hclk_shift_ = 0, apb1_shift_ = 0, apb2_shift_ = 0;
  Picoseconds switched_at_ = 0;  ///< when the system clock last changed its source
};

}  // namespace tetap::board
