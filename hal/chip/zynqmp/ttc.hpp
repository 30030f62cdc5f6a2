// SPDX-License-Identifier: Apache-2.0
// Microseconds since start from the triple timer counter. UG1085 chapter "Timers and Counters", section "Triple-Timer
// Counters"; UG1087 module "TTC". Silicon: 32 bits from LPD_LSBUS_CLK, 100 MHz. QEMU 7.2: the 16-bit counter of the
// older Zynq at 133 MHz.
#pragma once

#include "hal/chip/zynqmp/machine.hpp"
#include "tetap/base/time.hpp"

#include <cstdint>

namespace tetap::hal::zynqmp_r5 {

template <class Registers>
class Ttc {
 public:
  constexpr explicit Ttc(Registers registers) : registers_{registers} {}

  /// The interval register has 32 bits on silicon and 16 in the emulator: the value read back identifies the machine.
  [[nodiscard]] Machine probe() const {
    registers_.write(kInterval1, ~0U);
    return registers_.read(kInterval1) == ~0U ? Machine::kSilicon : Machine::kEmulated;
  }

  void start(Machine machine) {
    machine_ = machine;
    registers_.write(kCounterControl1, kCounterDisable);
    registers_.write(kClockControl1, (shape().prescale - 1) << 1 | 1U);
    registers_.write(kCounterControl1, kCounterReset);
    last_ = 0;
  }

  /// To be called before the counter has gone round: at least every 171 s on silicon, every 4 s in the emulator.
  [[nodiscard]] base::Micros now() {
    const std::uint32_t count = registers_.read(kCounter1);
    ticks_ += (count - last_) & shape().mask;
    last_ = count;
    return {static_cast<std::int64_t>((ticks_ << shape().prescale) / shape().clock_MHz)};
  }

 private:
  // UG1087, module TTC: offsets and bits used here.
  static constexpr std::uint32_t kClockControl1 = 0x00, kCounterControl1 = 0x0C, kCounter1 = 0x18, kInterval1 = 0x24;
  static constexpr std::uint32_t kCounterDisable = 1U << 0,
                                 kCounterReset = 1U << 4;  // counts up over its whole range otherwise

  struct Shape {
    std::uint32_t prescale;  ///< the clock is divided by 2 to this
    std::uint32_t clock_MHz;
    std::uint32_t mask;  ///< the bits the counter has
  };
  static constexpr Shape kSilicon{.prescale = 2, .clock_MHz = 100, .mask = 0xFFFF'FFFF};
  // 62 us a tick: with a finer one, 16 bits go round faster than a core may stand still on a busy computer.
  static constexpr Shape kEmulated{.prescale = 13, .clock_MHz = 133, .mask = 0xFFFF};
  [[nodiscard]] constexpr const Shape& shape() const { return machine_ == Machine::kSilicon ? kSilicon : kEmulated; }

  Registers registers_;
  Machine machine_ = Machine::kSilicon;
  std::uint64_t ticks_ = 0;
  std::uint32_t last_ = 0;
};

}  // namespace tetap::hal::zynqmp_r5
