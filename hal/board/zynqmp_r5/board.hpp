// SPDX-License-Identifier: Apache-2.0
// The Cortex-R5F of a Zynq UltraScale+ (ZCU102, Kria) with its first CAN controller, timer and serial port. Addresses:
// UG1085 table "PS I/O Peripherals Registers". Clocks and pins are set up by the first-stage boot loader; the reference
// clocks are those of its defaults.
#pragma once

#include "hal/board.hpp"
#include "hal/chip/support/image.hpp"
#include "hal/chip/support/mmio.hpp"
#include "hal/chip/support/text.hpp"
#include "hal/chip/zynqmp/can_controller.hpp"
#include "hal/chip/zynqmp/ttc.hpp"
#include "hal/chip/zynqmp/uart.hpp"

namespace tetap::hal::zynqmp_r5 {

inline constexpr Mmio kUart0{0xFF00'0000};
inline constexpr Mmio kCan0{0xFF06'0000};
inline constexpr Mmio kTtc0{0xFF11'0000};
inline constexpr std::uint32_t kCanReference_hz = 100'000'000;
inline constexpr std::uint32_t kCanBitRate = 500'000;

inline constexpr CanConfig kCanDefault{.timing = can_bit_timing(kCanReference_hz, kCanBitRate)};
static_assert(kCanReference_hz == kCanBitRate * kCanDefault.timing.prescaler * kCanDefault.timing.quanta());
static_assert(kCanDefault.timing.quanta() >= 16, "few quanta leave little to resynchronise with");

/// The same with a filter in the controller.
[[nodiscard]] constexpr CanConfig receiving(CanConfig config, Acceptance wanted) {
  config.filters[0] = {.id = wanted.id, .mask = wanted.mask};
  config.filter_count = 1;
  return config;
}

struct Board {
  explicit Board(const CanConfig& config = kCanDefault) {
    const Machine machine = timer_.probe();
    timer_.start(machine);
    uart_.start();
    can.start(machine, config);
    print(Text<>{}.add("tetap: zynqmp_r5 up, ").add(name(machine)).add('\n').c_str());
  }
  Board(const Board&) = delete;  // `can` holds the address of the timer
  Board& operator=(const Board&) = delete;

  [[nodiscard]] base::Micros now() { return timer_.now(); }
  void print(const char* text) const { uart_.print(text); }
  [[nodiscard]] static StackUse stack() { return stack_use(); }

 private:
  Ttc<Mmio> timer_{kTtc0};
  Uart uart_{kUart0};

 public:
  CanController<Mmio, Ttc<Mmio>> can{kCan0, timer_};
};

static_assert(hal::Board<Board>);

}  // namespace tetap::hal::zynqmp_r5
