// SPDX-License-Identifier: Apache-2.0
// The newer serial port: ISR and ICR in place of SR, RDR and TDR in place of DR, a prescaler, a kernel clock. RM0440
// chapter "Universal synchronous/asynchronous receiver transmitter (USART/UART)". Its FIFO mode is not modelled.
#pragma once

#include "sim_host/emulator/usart.hpp"

namespace tetap::board {

class UsartG4 final : public Usart {
 public:
  using Usart::Usart;

  std::uint32_t read(std::uint32_t offset) override;
  void write(std::uint32_t offset, std::uint32_t value, std::uint32_t mask) override;
  void reset() override;
  [[nodiscard]] std::int64_t baud() const override;

 private:
  [[nodiscard]] bool on() const override;
  [[nodiscard]] bool overrun_off() const override;
  void write_cr1(std::uint32_t value);
  void write_cr2(std::uint32_t value);
  void write_cr3(std::uint32_t value);
  void send(std::uint32_t value);
  std::uint32_t presc_ = 0;
};

}  // namespace tetap::board
