// SPDX-License-Identifier: Apache-2.0
// The serial port for boot lines and errors: 115200 baud 8N1, polled. UG1085 chapter "UART Controller", UG1087 module
// "UART".
#pragma once

#include "hal/chip/support/mmio.hpp"

#include <cstdint>

namespace tetap::hal::zynqmp_r5 {

struct Uart {
  Mmio registers;

  void start() const {
    registers.write(kControl, kTransmitOff | kReceiveOff);
    registers.write(kMode, kNoParity);
    registers.write(kBaudGenerator, 124);  // 100 MHz / (124 * (6 + 1)) = 115207
    registers.write(kBaudDivider, 6);
    registers.write(kControl, kTransmitOn | kReceiveOn);
  }

  /// A line that nobody drains is cut, never waited for without end: one character lasts 87 us.
  void print(const char* text) const {
    for (; *text != '\0'; ++text) {
      for (int i = 0; i < kPatience && (registers.read(kChannelStatus) & kTxFull) != 0; ++i) {
      }
      registers.write(kFifo, static_cast<std::uint8_t>(*text));
    }
  }

 private:
  static constexpr std::uint32_t kControl = 0x00, kMode = 0x04, kBaudGenerator = 0x18, kChannelStatus = 0x2C,
                                 kFifo = 0x30, kBaudDivider = 0x34;
  static constexpr std::uint32_t kTransmitOff = 1U << 5, kTransmitOn = 1U << 4, kReceiveOff = 1U << 3,
                                 kReceiveOn = 1U << 2;
  static constexpr std::uint32_t kNoParity = 4U << 3, kTxFull = 1U << 4;
  static constexpr int kPatience = 10'000;
};

}  // namespace tetap::hal::zynqmp_r5
