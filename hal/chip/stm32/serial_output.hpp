// SPDX-License-Identifier: Apache-2.0
// A console that only talks: a ring that the loop empties as the line takes it. RM0402 chapter "Universal synchronous
// receiver transmitter (USART)".
#pragma once

#include "hal/chip/stm32/usart_registers.hpp"

#include <array>
#include <cstddef>
#include <cstdint>

namespace tetap::hal::stm32 {

template <class Registers, std::size_t Capacity, class Usart = UsartOfF4>
class SerialOutput {
 public:
  constexpr explicit SerialOutput(Registers registers) : registers_{registers} {}

  void start(std::uint32_t clock_hz, std::uint32_t baud) const {
    registers_.write(Usart::kControl1, 0);
    registers_.write(Usart::kControl2, 0);
    registers_.write(Usart::kControl3, 0);
    registers_.write(Usart::kBaudRate, (clock_hz + baud / 2) / baud);
    registers_.write(Usart::kControl1, Usart::kEnable | usart::cr1::kTe.mask());
  }

  /// Text that does not fit is cut: a console must not hold the loop.
  void print(const char* text) {
    for (; *text != '\0' && put_ - sent_ < Capacity; ++text) ring_[put_++ % Capacity] = *text;
  }

  /// As much as the line takes now.
  void drain() {
    while (sent_ != put_ && usart::sr::kTxe.of(registers_.read(Usart::kStatus)) != 0) {
      registers_.write(Usart::kTransmitData, static_cast<std::uint8_t>(ring_[sent_++ % Capacity]));
    }
  }

  /// Waits until all is out, but no longer than a character takes for each: for a boot line, before anything is due.
  void finish() {
    for (std::uint32_t i = 0; sent_ != put_ && i < kPatience * Capacity; ++i) drain();
  }

 private:
  // One character at 115 200 baud lasts 87 us, some 1 400 reads of the status register.
  static constexpr std::uint32_t kPatience = 3000;

  Registers registers_;
  std::array<char, Capacity> ring_{};
  std::uint32_t put_ = 0;   ///< characters put into the ring, modulo 2^32
  std::uint32_t sent_ = 0;  ///< characters given to the line
};

}  // namespace tetap::hal::stm32
