// SPDX-License-Identifier: Apache-2.0
// Microseconds since start in 64 bits from SysTick, which also wakes the core once a millisecond. ARM DDI 0403E.e B3.3:
// the counter goes from reload to 0; the step from 1 to 0 pends the exception, the next one reloads.
#pragma once

#include "hal/chip/arm/cortex_m4.hpp"
#include "tetap/base/time.hpp"

#include <cstdint>

namespace tetap::hal {

/// `Registers`: the system control space.
template <class Registers>
class SysTickClock {
 public:
  static constexpr std::uint32_t kTick_us = 1000;

  constexpr explicit SysTickClock(Registers registers) : registers_{registers} {}

  void start(std::uint32_t core_hz) {
    namespace tick = cortex_m4::systick;
    cycles_per_us_ = core_hz / 1'000'000;
    cycles_ = cycles_per_us_ * kTick_us;
    registers_.write(tick::kCsr, 0);
    registers_.write(tick::kRvr, cycles_ - 1);
    registers_.write(tick::kCvr, 0);
    registers_.write(tick::kCsr, tick::kEnable.mask() | tick::kTickint.mask() | tick::kClksource.mask());
  }

  /// The SysTick exception.
  void on_interrupt() {
    const std::uint32_t next = low_ + 1;
    if (next == 0) high_ = high_ + 1;
    low_ = next;
  }

  /// From the loop and from handlers that SysTick does not interrupt; a tick that is pending there counts.
  [[nodiscard]] base::Micros now() const {
    for (;;) {
      const std::uint32_t low = low_;
      const std::uint32_t high = high_;
      std::uint32_t left = registers_.read(cortex_m4::systick::kCvr);
      const bool pending = cortex_m4::scb::kPendstset.of(registers_.read(cortex_m4::scb::kIcsr)) != 0;
      // The counter may have passed 0 between the two reads; what it shows now is behind the pending tick.
      if (pending) left = registers_.read(cortex_m4::systick::kCvr);
      if (low != low_) continue;  // a tick came: once a millisecond, so the next pass succeeds
      const std::uint64_t ticks = (std::uint64_t{high} << 32 | low) + (pending ? 1U : 0U);
      const std::uint32_t phase = left == 0 ? 0 : cycles_ - left;
      return {static_cast<std::int64_t>(ticks * kTick_us + phase / cycles_per_us_)};
    }
  }

  /// For the test of the wrap of 32 bits of milliseconds, 49.7 days after start.
  void set_ticks(std::uint64_t ticks) {
    low_ = static_cast<std::uint32_t>(ticks);
    high_ = static_cast<std::uint32_t>(ticks >> 32);
  }

 private:
  Registers registers_;
  std::uint32_t cycles_ = 1;         ///< cycles of the core in a tick
  std::uint32_t cycles_per_us_ = 1;  ///< whole: every clock of the board is a multiple of 1 MHz
  volatile std::uint32_t low_ = 0;   ///< ticks since start, lower half; the exception writes
  volatile std::uint32_t high_ = 0;
};

}  // namespace tetap::hal
