// SPDX-License-Identifier: Apache-2.0
// A timer that counts a quadrature encoder's edges, both edges of both channels, over its whole width. RM0402 chapter
// "General-purpose timers (TIM2 to TIM5)", section "Encoder interface mode".
#pragma once

#include "hal/chip/stm32/registers_stm32f412.hpp"
#include "hal/encoder_counter.hpp"

#include <cstdint>
#include <limits>

namespace tetap::hal::stm32 {

namespace tim = stm32f412::tim;

/// `CounterType`: std::uint32_t for TIM2 and TIM5, std::uint16_t for TIM3 and TIM4.
template <class Registers, class CounterType>
class EncoderTimer {
 public:
  using Counter = CounterType;

  constexpr explicit EncoderTimer(Registers registers) : registers_{registers} {}

  void start() {
    // Eight samples at 1/8 of the timer's clock must agree: 0.67 us at 96 MHz, a fifth of the time between two edges at
    // 300 000 counts per second.
    constexpr std::uint32_t kFilter = 0b1001;
    constexpr std::uint32_t kInputOfSameNumber = 1;
    constexpr std::uint32_t kEncoderBothEdges = 3;
    registers_.write(tim::cr1::kOffset, 0);
    registers_.write(tim::smcr::kOffset, tim::smcr::kSms(kEncoderBothEdges));
    registers_.write(tim::ccmr1_input::kOffset,
                     tim::ccmr1_input::kCc1s(kInputOfSameNumber) | tim::ccmr1_input::kIc1f(kFilter) |
                         tim::ccmr1_input::kCc2s(kInputOfSameNumber) | tim::ccmr1_input::kIc2f(kFilter));
    registers_.write(tim::ccer::kOffset, 0);  // neither input inverted
    registers_.write(tim::psc::kOffset, 0);
    registers_.write(tim::arr::kOffset, std::numeric_limits<Counter>::max());
    registers_.write(tim::cnt::kOffset, 0);
    registers_.write(tim::egr::kOffset, tim::egr::kUg.mask());  // takes PSC and ARR over
    registers_.write(tim::cr1::kOffset, tim::cr1::kCen.mask());
  }

  /// Without a time of the last edge: this timer has no capture channel left.
  [[nodiscard]] EncoderReading<Counter> read() const {
    return {.count = static_cast<Counter>(registers_.read(tim::cnt::kOffset))};
  }

 private:
  Registers registers_;
};

}  // namespace tetap::hal::stm32
