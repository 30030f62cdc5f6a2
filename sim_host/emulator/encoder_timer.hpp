// SPDX-License-Identifier: Apache-2.0
// A general-purpose timer in encoder mode. RM0440 chapter "General-purpose timers (TIM2/TIM3/TIM4/TIM5)" adds modes to
// the same registers, which are not modelled. RM0402 chapter "General-purpose timers (TIM2 to TIM5)", section "Encoder
// interface mode" with its table of counting direction against edges.
#pragma once

#include "sim_host/emulator/gpio.hpp"
#include "sim_host/emulator/peripheral.hpp"

#include <cstdint>
#include <functional>

namespace tetap::board {

/// Position of an encoder's shaft in edges of both lines; a quarter of a line's period each, line A leads forward.
using EncoderPosition = std::function<std::int64_t(Picoseconds time)>;

class EncoderTimer final : public Peripheral {
 public:
  struct Wiring {
    Signal ch1_signal, ch2_signal;
    Pin ch1, ch2;
    int interrupt;
    int width;  ///< bits of the counter
  };
  EncoderTimer(Surroundings around, std::string name, std::uint32_t base, const Pins& pins, Wiring wiring,
               std::function<std::int64_t()> clock_hz);

  std::uint32_t read(std::uint32_t offset) override;
  void write(std::uint32_t offset, std::uint32_t value, std::uint32_t mask) override;
  void reset() override;

  /// The shaft; the model looks at it whenever a register is used. Empty: unplugged, the lines stand still.
  EncoderPosition position;
  /// Looks at what else the lines need when the counter is switched on; empty: nothing.
  std::function<void()> on_start;
  /// Time that a level must last behind the input filter that is set (IC1F); the model does not apply it.
  [[nodiscard]] Picoseconds filter_time() const;

 private:
  void follow();
  void step(bool forward, std::int64_t phase);
  void count(bool up);
  void check();
  [[nodiscard]] bool encoder_mode() const { return sms() >= 1 && sms() <= 3; }
  [[nodiscard]] std::uint32_t sms() const;
  [[nodiscard]] std::uint32_t full() const;

  const Pins& pins_;
  Wiring wiring_;
  std::function<std::int64_t()> clock_hz_;
  std::uint32_t cr1_ = 0, smcr_ = 0, dier_ = 0, sr_ = 0, ccmr1_ = 0, ccer_ = 0, cnt_ = 0, psc_ = 0, arr_ = 0;
  std::int64_t seen_ = 0;  ///< position that has been counted up to
  std::uint32_t prescaled_ = 0;
};

}  // namespace tetap::board
