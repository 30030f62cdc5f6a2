// SPDX-License-Identifier: Apache-2.0
// Samples in the order in which they were true: those waiting for their tick, and the recent past kept so that a late
// one can still be fused at its own time.
#pragma once

#include "app/sample.hpp"

#include <array>
#include <cstddef>
#include <cstdint>

namespace tetap::app {

enum class Insert : std::uint8_t { kTaken, kDuplicate, kFull };

/// When full, insert() refuses; the caller then retires the oldest consumed sample and tries again, or counts the loss.
template <std::size_t Capacity>
class Timeline {
 public:
  /// Keeps the order; a sample equal in stamp, kind, instance, sequence and detail is a duplicate.
  [[nodiscard]] constexpr Insert insert(const Sample& sample) {
    std::size_t at = size_;
    while (at > 0 && samples_[at - 1].order(sample) > 0) --at;
    if (at > 0 && samples_[at - 1].order(sample) == 0) {
      // Two that claim to be one sample and differ: the one whose frames have the smaller sum, whichever came first.
      if (!consumed_[at - 1] && sample.bits < samples_[at - 1].bits) samples_[at - 1] = sample;
      return Insert::kDuplicate;
    }
    if (size_ == Capacity) return Insert::kFull;
    for (std::size_t i = size_; i > at; --i) {
      samples_[i] = samples_[i - 1];
      consumed_[i] = consumed_[i - 1];
    }
    samples_[at] = sample;
    consumed_[at] = false;
    ++size_;
    if (size_ > high_water_) high_water_ = static_cast<std::uint16_t>(size_);
    return Insert::kTaken;
  }

  /// How many samples have a stamp <= t.
  [[nodiscard]] constexpr std::size_t until(base::Micros t) const {
    std::size_t n = size_;
    while (n > 0 && samples_[n - 1].stamp > t) --n;
    return n;
  }

  constexpr void drop_front(std::size_t count) {
    for (std::size_t i = count; i < size_; ++i) {
      samples_[i - count] = samples_[i];
      consumed_[i - count] = consumed_[i];
    }
    size_ -= count;
  }
  constexpr void clear() { size_ = 0; }
  constexpr void power_on() { size_ = 0, high_water_ = 0; }

  /// Of the content, in order: a polynomial in an odd number modulo 2^32. A sample's payload is in its frames' CRC
  /// already, so this has only to tell which samples there are.
  [[nodiscard]] constexpr std::uint32_t digest() const {
    constexpr std::uint32_t kOdd = 0x01000193;
    std::uint32_t sum = static_cast<std::uint32_t>(size_);
    for (std::size_t i = 0; i < size_; ++i) {
      const auto stamp = static_cast<std::uint64_t>(samples_[i].stamp.us);
      sum = sum * kOdd + static_cast<std::uint32_t>(stamp);
      sum = sum * kOdd + static_cast<std::uint32_t>(stamp >> 32);
      sum = sum * kOdd + samples_[i].bits;
    }
    return sum;
  }

  [[nodiscard]] constexpr const Sample& operator[](std::size_t i) const { return samples_[i]; }
  /// The current estimate has it, and its record went out.
  [[nodiscard]] constexpr bool consumed(std::size_t i) const { return consumed_[i]; }
  constexpr void consume(std::size_t i) { consumed_[i] = true; }
  [[nodiscard]] constexpr std::size_t size() const { return size_; }
  [[nodiscard]] constexpr std::uint16_t high_water() const { return high_water_; }

 private:
  std::array<Sample, Capacity> samples_{};
  std::array<bool, Capacity> consumed_{};
  std::size_t size_ = 0;
  std::uint16_t high_water_ = 0;
};

}  // namespace tetap::app
