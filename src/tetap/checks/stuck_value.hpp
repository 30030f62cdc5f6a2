// SPDX-License-Identifier: Apache-2.0
// Repeated readings. A sensor whose noise spans the steps of its interface repeats a value by chance a few times. One
// that repeats it ten or fifty times is stuck.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/checks/persistence.hpp"

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

namespace tetap::checks {

/// Counts readings in a row that differ from the one before by no more than `step` on every axis.
template <std::size_t kSize>
class RepeatCounter {
 public:
  using Reading = std::array<float, kSize>;

  [[nodiscard]] static bool alike(const Reading& a, const Reading& b, float step) {
    for (std::size_t i = 0; i < kSize; ++i)
      if (a[i] - b[i] > step || b[i] - a[i] > step) return false;
    return true;
  }
  /// Finite readings. True from the n-th repetition on; n = 0: never.
  bool update(const Reading& now, float step, std::int32_t n) {
    count_ = alike(last_, now, step) ? static_cast<std::uint8_t>(count_ < 255 ? count_ + 1 : 255) : std::uint8_t{0};
    last_ = now;
    stuck_ = n > 0 && count_ >= n;
    return stuck_;
  }
  /// The last reading was at least the n-th repetition.
  [[nodiscard]] bool stuck() const { return stuck_; }
  /// The last reading was `reading`, and repeated nothing.
  void restart(const Reading& reading) {
    last_ = reading;
    count_ = 0;
    stuck_ = false;
  }
  static constexpr auto members(auto& self) { return base::members(self.last_, self.count_, self.stuck_); }

 private:
  Reading last_{};
  std::uint8_t count_ = 0;
  bool stuck_ = false;
};

/// One axis of three that keeps its value to the last bit at reading after reading in which both others changed. Rest
/// and a coarse resolution leave two axes or all alike, which counts for nothing.
class StuckAxis {
 public:
  static constexpr std::uint8_t kReadings = 32;  ///< make a stuck axis

  /// True while an axis is stuck.
  bool update(const std::array<float, 3>& now) {
    unsigned same = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      const auto bits = std::bit_cast<std::uint32_t>(now[i]);
      same |= bits == last_[i] ? 1U << i : 0U;
      last_[i] = bits;
    }
    if ((same & (same - 1U)) == 0) follow(same);
    return count_ >= kReadings;
  }
  [[nodiscard]] bool stuck() const { return count_ >= kReadings; }
  static constexpr auto members(auto& self) { return base::members(self.last_, self.axis_, self.count_); }

 private:
  /// At most one axis is as it was: a bit of `same`, or 0.
  void follow(unsigned same) {
    if (same == 0 || same != axis_) count_ = 0;
    axis_ = static_cast<std::uint8_t>(same);
    if (same != 0 && count_ < kReadings) ++count_;
  }

  std::array<std::uint32_t, 3> last_{};  ///< bits of the last reading
  std::uint8_t axis_ = 0;                ///< bit of the axis that kept its value; 0: none
  std::uint8_t count_ = 0;               ///< readings at which that one alone kept its value
};

/// Readings that repeat to the last bit, with the time of the last reading.
template <std::size_t kSize>
class StuckValue {
 public:
  /// Finite readings. True from the n-th repetition on; n = 0: never.
  bool update(const std::array<float, kSize>& now, std::int32_t n, base::Micros stamp) {
    last_ = stamp;
    return repeats_.update(now, 0.0F, n);
  }
  /// The last reading is at most two seconds old and was a stuck one.
  [[nodiscard]] bool stuck(base::Micros at) const { return repeats_.stuck() && recent(last_, at, kFresh); }
  [[nodiscard]] base::Micros last() const { return last_; }
  static constexpr auto members(auto& self) { return base::members(self.last_, self.repeats_); }

 private:
  static constexpr base::Micros kFresh{2'000'000};

  base::Micros last_;  ///< stamp of the last reading
  RepeatCounter<kSize> repeats_;
};

}  // namespace tetap::checks
