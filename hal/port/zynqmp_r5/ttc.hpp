// SPDX-License-Identifier: Apache-2.0
// Microseconds since start from the triple timer counter. UG1085 chapter "Timers and Counters", section "Triple-Timer Counters";
// UG1087 module "TTC". Silicon: 32 bits from LPD_LSBUS_CLK, 100 MHz. QEMU 7.2: the 16-bit counter of the older Zynq at 133 MHz.
#pragma once

#include "base/time.hpp"
#include "hal/port/zynqmp_r5/machine.hpp"

#include <cstdint>

namespace tetap::hal::zynqmp_r5 {

template <class Registers>
class Ttc {
 public:
  constexpr explicit Ttc(Registers registers) : registers_{registers} {}

  /// The interval register has 32 bits on silicon and 16 in the emulator: what comes back tells which machine this is.
  [[nodiscard]] Machine probe() const {
    registers_.write(kInterval1, ~0U);
    return registers_.read(kInterval1) == ~0U ? Machine::kSilicon : Machine::kEmulated;
  }

  void start(Machine machine) {
    machine_ = machine;
    const bool silicon = machine == Machine::kSilicon;
    registers_.write(kCounterControl1, kCounterDisable);
    registers_.write(kClockControl1, prescale(silicon ? kSiliconPrescale : kEmulatedPrescale));
    registers_.write(kClockControl2, prescale(kCoarsePrescale));
    registers_.write(kCounterControl1, kCounterReset);
    registers_.write(kCounterControl2, kCounterReset);
    last_ = 0;
    coarse_last_ = 0;
  }

  /// To be called at least every 171 s on silicon, every 32 s in the emulator.
  [[nodiscard]] base::Micros now() {
    if (machine_ == Machine::kSilicon) {
      const std::uint32_t count = registers_.read(kCounter1);
      ticks_ += count - last_;
      last_ = count;
      return {static_cast<std::int64_t>(ticks_ / kSiliconTicksPer_us)};
    }
    const std::uint32_t count = registers_.read(kCounter1) & 0xFFFFU;
    ticks_ += (count - last_) & 0xFFFFU;
    last_ = count;
    // 16 bits wrap every 63 ms, and an emulated core may stand still longer than that. Counter 2 runs 512 times slower; the time whose
    // low bits are those of counter 1 and which is nearest to it is right however long the pause. Read seldom, because each read
    // of the emulated counter rounds its time down a little.
    if (ticks_ - checked_ >= kCheckEvery) {
      const std::uint32_t coarse = registers_.read(kCounter2) & 0xFFFFU;
      coarse_ticks_ += (coarse - coarse_last_) & 0xFFFFU;
      coarse_last_ = coarse;
      const auto reference = static_cast<std::int64_t>(coarse_ticks_ << (kCoarsePrescale - kEmulatedPrescale));
      const std::int64_t extended = base::extend(count, 16, base::Micros{reference}).us;
      if (extended > static_cast<std::int64_t>(ticks_)) ticks_ = static_cast<std::uint64_t>(extended);
      checked_ = ticks_;
    }
    return {static_cast<std::int64_t>((ticks_ << kEmulatedPrescale) / kEmulatedClock_MHz)};
  }

 private:
  // UG1087, module TTC: offsets and bits used here.
  static constexpr std::uint32_t kClockControl1 = 0x00, kClockControl2 = 0x04, kCounterControl1 = 0x0C, kCounterControl2 = 0x10;
  static constexpr std::uint32_t kCounter1 = 0x18, kCounter2 = 0x1C, kInterval1 = 0x24;
  static constexpr std::uint32_t kCounterDisable = 1U << 0, kCounterReset = 1U << 4;  // counting up over the whole range otherwise
  static constexpr unsigned kSiliconClock_MHz = 100, kEmulatedClock_MHz = 133;
  static constexpr unsigned kSiliconPrescale = 2, kEmulatedPrescale = 7, kCoarsePrescale = 16;  // the clock is divided by 2 to this
  static constexpr std::uint64_t kSiliconTicksPer_us = kSiliconClock_MHz >> kSiliconPrescale;
  static_assert((kSiliconTicksPer_us << kSiliconPrescale) == kSiliconClock_MHz, "a whole number of ticks in a microsecond");
  static constexpr std::uint64_t kCheckEvery = 1U << 14;  // 16 ms

  [[nodiscard]] static constexpr std::uint32_t prescale(unsigned power) { return (power - 1) << 1 | 1U; }

  Registers registers_;
  Machine machine_ = Machine::kSilicon;
  std::uint64_t ticks_ = 0;
  std::uint64_t checked_ = 0;
  std::uint64_t coarse_ticks_ = 0;
  std::uint32_t last_ = 0;
  std::uint32_t coarse_last_ = 0;
};

}  // namespace tetap::hal::zynqmp_r5
