// SPDX-License-Identifier: Apache-2.0
// The independent watchdog, with a time that holds at every frequency its oscillator may have. RM0402 chapter
// "Independent watchdog (IWDG)"; the low-speed oscillator's 17 to 47 kHz: data sheet of the STM32F412xE/G (DS11139),
// table "LSI oscillator characteristics".
#pragma once

#include "hal/chip/stm32/registers_stm32f412.hpp"

#include <cstdint>

namespace tetap::hal::stm32 {

namespace iwdg = stm32f412::iwdg;

struct WatchdogTime {
  static constexpr std::uint32_t kSlowest_hz = 17'000, kNominal_hz = 32'000, kFastest_hz = 47'000;

  std::uint32_t prescaler = 0;  ///< PR: the oscillator is divided by 4 times 2 to this
  std::uint32_t reload = 0;     ///< RLR: counts of the divided oscillator, less one

  [[nodiscard]] constexpr std::uint32_t us_at(std::uint32_t oscillator_hz) const {
    const std::uint64_t cycles = std::uint64_t{reload + 1} << (2 + prescaler);
    return static_cast<std::uint32_t>(cycles * 1'000'000 / oscillator_hz);
  }
  /// The loop must come round in half of this.
  [[nodiscard]] constexpr std::uint32_t shortest_us() const { return us_at(kFastest_hz); }
  [[nodiscard]] constexpr std::uint32_t longest_us() const { return us_at(kSlowest_hz); }
};

/// The finest step that reaches `nominal_us` at 32 kHz; up to 32.7 s.
[[nodiscard]] constexpr WatchdogTime watchdog_time(std::uint32_t nominal_us) {
  constexpr std::uint32_t kMostReload = 1U << iwdg::rlr::kRl.width;
  constexpr std::uint32_t kMostPrescaler = 6;
  WatchdogTime time;
  for (;; ++time.prescaler) {
    const std::uint64_t counts =
        std::uint64_t{nominal_us} * WatchdogTime::kNominal_hz / (1'000'000ULL << (2 + time.prescaler));
    if (counts <= kMostReload || time.prescaler == kMostPrescaler) {
      time.reload = static_cast<std::uint32_t>(counts < 1 ? 1 : counts > kMostReload ? kMostReload : counts) - 1;
      return time;
    }
  }
}

/// The finest step whose shortest time is above `least_us`; up to 22 s.
[[nodiscard]] constexpr WatchdogTime watchdog_time_above(std::uint32_t least_us) {
  const std::uint64_t nominal_us =
      std::uint64_t{least_us} * WatchdogTime::kFastest_hz / WatchdogTime::kNominal_hz * 101 / 100;
  return watchdog_time(static_cast<std::uint32_t>(nominal_us));
}

template <class Registers>
class Watchdog {
 public:
  constexpr explicit Watchdog(Registers registers) : registers_{registers} {}

  /// Nothing but a reset stops it from here on. False: it runs, but its registers did not take the time.
  bool start(const WatchdogTime& time) const {
    registers_.write(iwdg::kr::kOffset, kStart);
    registers_.write(iwdg::kr::kOffset, kUnlock);
    // A value of before a boot loader may still be on its way into the oscillator's domain.
    bool good = settles();
    registers_.write(iwdg::pr::kOffset, time.prescaler);
    registers_.write(iwdg::rlr::kOffset, time.reload);
    good = settles() && good;
    kick();
    return good;
  }

  void kick() const { registers_.write(iwdg::kr::kOffset, kReload); }

 private:
  static constexpr std::uint32_t kStart = 0xCCCC, kUnlock = 0x5555, kReload = 0xAAAA;
  // Five periods of the slowest oscillator, 0.3 ms: some 3 000 reads over APB1.
  static constexpr int kPatience = 10'000;

  [[nodiscard]] bool settles() const {
    for (int i = 0; i < kPatience; ++i) {
      if ((registers_.read(iwdg::sr::kOffset) & (iwdg::sr::kPvu.mask() | iwdg::sr::kRvu.mask())) == 0) return true;
    }
    return false;
  }

  Registers registers_;
};

}  // namespace tetap::hal::stm32
