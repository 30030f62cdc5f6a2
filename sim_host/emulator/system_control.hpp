// SPDX-License-Identifier: Apache-2.0
// System control space of the Cortex-M4: SysTick, NVIC registers, SCB with fault status and reset request, CPACR, MPU
// regions, DWT cycle counter. ARM DDI 0403E.e chapters B3 and C1.8; hal/chip/arm/cortex_m4.hpp has the addresses.
#pragma once

#include "sim_host/emulator/nvic.hpp"
#include "sim_host/emulator/peripheral.hpp"

#include <array>
#include <cstdint>
#include <functional>

namespace tetap::board {

/// Timer of the core, B3.3: counts down from the reload value, one period is reload + 1.
class SysTick {
 public:
  SysTick(Scheduler& scheduler, CoreClock& clock, Nvic& nvic);
  void reset();
  [[nodiscard]] std::uint32_t read(std::uint32_t offset);
  void write(std::uint32_t offset, std::uint32_t value);
  /// The core's frequency has changed: the next zero keeps its cycle.
  void replan();

 private:
  [[nodiscard]] std::int64_t cycle() const { return clock_.cycle_at(scheduler_.now()); }
  [[nodiscard]] std::int64_t scale() const;
  void zero();

  Scheduler& scheduler_;
  CoreClock& clock_;
  Nvic& nvic_;
  Alarm alarm_;
  std::uint32_t control_ = 0, reload_ = 0;
  std::uint32_t stopped_at_ = 0;  ///< value while disabled
  std::int64_t zero_cycle_ = 0;   ///< cycle at which the counter reaches 0, while enabled
  bool count_flag_ = false;
};

/// A region of the MPU, B3.5.9.
struct MpuRegion {
  std::uint32_t rbar = 0, rasr = 0;
};

class SystemControl final : public Peripheral {
 public:
  SystemControl(Surroundings around, CoreClock& clock, Nvic& nvic);

  std::uint32_t read(std::uint32_t offset) override;
  void write(std::uint32_t offset, std::uint32_t value, std::uint32_t mask) override;
  void reset() override;

  [[nodiscard]] std::uint32_t vector_table() const { return vtor_; }
  [[nodiscard]] bool floating_point_on() const { return (cpacr_ >> 20 & 0xF) == 0xF; }
  [[nodiscard]] bool mpu_on() const { return (mpu_control_ & 1) != 0; }
  /// MPU_CTRL.HFNMIENA: it acts in HardFault, NMI and under FAULTMASK, too.
  [[nodiscard]] bool mpu_in_faults() const { return (mpu_control_ & 2) != 0; }
  [[nodiscard]] const std::array<MpuRegion, 8>& mpu_regions() const { return regions_; }
  /// Fault handlers on: SHCSR.
  [[nodiscard]] bool handler_on(int number) const { return nvic_.enabled(number); }
  void report_fault(std::uint32_t cfsr, bool with_address, std::uint32_t address);
  void report_forced() { hfsr_ |= 1U << 30; }
  void report_vector_fault() { hfsr_ |= 1U << 1; }
  void set_active_exception(int number) { active_exception_ = number; }
  SysTick& systick() { return systick_; }

  std::function<void()> on_reset_request;  ///< AIRCR.SYSRESETREQ
  std::function<void()> on_mpu_change;

  /// DWT_CTRL and DWT_CYCCNT, offsets from kDwt.
  std::uint32_t read_dwt(std::uint32_t offset);
  void write_dwt(std::uint32_t offset, std::uint32_t value);

 private:
  [[nodiscard]] std::uint32_t read_scb(std::uint32_t offset);
  void write_scb(std::uint32_t offset, std::uint32_t value, std::uint32_t mask);
  [[nodiscard]] std::uint32_t bits(std::uint32_t offset, bool (Nvic::*get)(int) const) const;
  void write_bits(std::uint32_t offset, std::uint32_t value);
  [[nodiscard]] std::uint32_t priorities(int first) const;
  void set_priorities(int first, std::uint32_t value, std::uint32_t mask);
  void write_icsr(std::uint32_t value);
  void write_aircr(std::uint32_t value);
  void write_mpu(std::uint32_t offset, std::uint32_t value);
  [[nodiscard]] std::uint32_t icsr() const;

  CoreClock& clock_;
  Nvic& nvic_;
  SysTick systick_;
  std::uint32_t vtor_ = 0, scr_ = 0, ccr_ = 0x200, prigroup_ = 0, cfsr_ = 0, hfsr_ = 0, mmfar_ = 0, bfar_ = 0,
                cpacr_ = 0, demcr_ = 0, fpccr_ = 0xC000'0000;
  std::uint32_t mpu_control_ = 0, mpu_region_ = 0;
  std::array<MpuRegion, 8> regions_{};
  int active_exception_ = 0;
  bool dwt_on_ = false;
  std::int64_t dwt_zero_cycle_ = 0;
};

}  // namespace tetap::board
