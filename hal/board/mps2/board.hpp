// SPDX-License-Identifier: Apache-2.0
// ARM's MPS2 board as QEMU runs it: mps2-an500 is a Cortex-M7, mps2-an386 a Cortex-M4F. For tests and counts, not for a
// robot. Registers: ARM DUI 0959 (CMSDK, "Cortex-M System Design Kit"), chapter 4: APB timer and UART; 25 MHz on both
// boards.
#pragma once

#include "hal/board.hpp"
#include "hal/board/mps2/file_can.hpp"
#include "hal/chip/arm/semihosting.hpp"
#include "hal/chip/support/image.hpp"
#include "hal/chip/support/mmio.hpp"
#include "hal/chip/support/text.hpp"

namespace tetap::hal::mps2 {

inline constexpr Mmio kTimer0{0x4000'0000};
inline constexpr Mmio kUart0{0x4000'4000};

struct Uart {
  void start() const {
    kUart0.write(kBaudDivider, 217);  // 25 MHz / 115200
    kUart0.write(kControl, kTransmitOn);
  }
  void print(const char* text) const {
    for (; *text != '\0'; ++text) {
      for (int i = 0; i < kPatience && (kUart0.read(kState) & kTxFull) != 0; ++i) {
      }
      kUart0.write(kData, static_cast<std::uint8_t>(*text));
    }
  }

 private:
  static constexpr std::uint32_t kData = 0x00, kState = 0x04, kControl = 0x08, kBaudDivider = 0x10;
  static constexpr std::uint32_t kTxFull = 1U << 0, kTransmitOn = 1U << 0;
  static constexpr int kPatience = 1'000'000;
};

struct Board {
  Board() {
    kTimer0.write(kReload, ~0U);
    kTimer0.write(kValue, ~0U);
    kTimer0.write(kTimerControl, kTimerOn);
    uart_.start();
  }

  /// Counts down at 25 MHz; to be called at least every 171 s.
  [[nodiscard]] base::Micros now() {
    const std::uint32_t value = kTimer0.read(kValue);
    ticks_ += last_ - value;
    last_ = value;
    return {static_cast<std::int64_t>(ticks_ / 25)};
  }
  void print(const char* text) const { uart_.print(text); }
  [[nodiscard]] static StackUse stack() { return stack_use(); }
  [[noreturn]] static void exit(int status) { semihosting::exit(status); }

  FileCan can;

 private:
  static constexpr std::uint32_t kTimerControl = 0x00, kValue = 0x04, kReload = 0x08, kTimerOn = 1U << 0;

  Uart uart_;
  std::uint32_t last_ = ~0U;
  std::uint64_t ticks_ = 0;
};

static_assert(hal::Board<Board>);

}  // namespace tetap::hal::mps2
