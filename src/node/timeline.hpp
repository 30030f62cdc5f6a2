// SPDX-License-Identifier: Apache-2.0
// Samples in the order in which they were true: those waiting for their tick, and the recent past kept so that a late
// one can still be fused at its own time. A ring: what leaves at the front moves nothing.
#pragma once

#include "sensor/sample.hpp"
#include "sensor/window.hpp"

#include <array>
#include <cstddef>
#include <cstdint>

namespace tetap::node {

/// kMadeRoom: taken, and for it the oldest left before its time. kTooMuch: beyond what a tick may work on.
enum class Insert : std::uint8_t { kTaken, kDuplicate, kFull, kMadeRoom, kTooMuch };

/// When full, insert() refuses; the caller then retires the oldest consumed sample and tries again, or counts the loss.
template <std::size_t Capacity>
class Timeline {
 public:
  /// Keeps the order; a sample equal in stamp, kind, instance, sequence and detail is a duplicate.
  /// It may move as many samples as `moves`; then this is how many it moved.
  [[nodiscard]] constexpr Insert insert(const sensor::Sample& sample, std::size_t& moves) {
    std::size_t at = size_;
    for (; at > 0 && (*this)[at - 1].order(sample) > 0; --at)
      if (size_ - at == moves) return Insert::kTooMuch;
    moves = size_ - at;
    if (at > 0 && (*this)[at - 1].order(sample) == 0) {
      // Two that claim to be one sample and differ: the one whose frames have the smaller sum, whichever came first.
      if (!consumed(at - 1) && sample.bits < (*this)[at - 1].bits) samples_[place(at - 1)] = sample;
      return Insert::kDuplicate;
    }
    if (size_ == Capacity) return Insert::kFull;
    std::size_t to = place(size_);
    for (std::size_t i = size_; i > at; --i) {
      const std::size_t from = to > 0 ? to - 1 : Capacity - 1;
      samples_[to] = samples_[from];
      consumed_[to] = consumed_[from];
      to = from;
    }
    samples_[to] = sample;
    consumed_[to] = false;
    ++size_;
    ++new_;
    if (at < known_) known_ = at;
    if (size_ > high_water_) high_water_ = static_cast<std::uint16_t>(size_);
    return Insert::kTaken;
  }

  /// The same without a limit.
  [[nodiscard]] constexpr Insert insert(const sensor::Sample& sample) {
    std::size_t moves = Capacity;
    return insert(sample, moves);
  }

  /// How many samples have a stamp <= t.
  [[nodiscard]] constexpr std::size_t until(base::Micros t) const {
    std::size_t n = size_;
    while (n > 0 && (*this)[n - 1].stamp > t) --n;
    return n;
  }

  constexpr void drop_front(std::size_t count) {
    for (std::size_t i = known_; i < count; ++i) new_ -= consumed(i) ? 0 : 1;
    begin_ = place(count);
    size_ -= count;
    known_ = new_ == 0 ? size_ : known_ > count ? known_ - count : 0;
  }
  constexpr void clear() { size_ = known_ = new_ = 0; }
  constexpr void power_on() { begin_ = size_ = known_ = new_ = 0, high_water_ = 0; }

  /// Digest of the content, in order: a polynomial in an odd number modulo 2^32. A sample's payload is in its frames'
  /// CRC already, so this one only has to identify the samples.
  [[nodiscard]] constexpr std::uint32_t digest() const {
    constexpr std::uint32_t kOdd = 0x01000193;
    std::uint32_t sum = static_cast<std::uint32_t>(size_);
    for (std::size_t i = 0; i < size_; ++i) {
      const sensor::Sample& sample = (*this)[i];
      const auto stamp = static_cast<std::uint64_t>(sample.stamp.us);
      sum = sum * kOdd + static_cast<std::uint32_t>(stamp);
      sum = sum * kOdd + static_cast<std::uint32_t>(stamp >> 32);
      sum = sum * kOdd + sample.bits;
    }
    return sum;
  }

  /// Its first `size` samples.
  [[nodiscard]] constexpr sensor::Window window(std::size_t size) const {
    return {samples_.data(), Capacity, begin_, size};
  }
  [[nodiscard]] constexpr const sensor::Sample& operator[](std::size_t i) const { return samples_[place(i)]; }
  /// The current estimate has it, and its record went out.
  [[nodiscard]] constexpr bool consumed(std::size_t i) const { return consumed_[place(i)]; }
  constexpr void consume(std::size_t i) {
    if (consumed(i)) return;
    consumed_[place(i)] = true;
    --new_;
    if (i == known_) ++known_;
    if (new_ == 0) known_ = size_;
  }
  /// Number of samples at the front that are certainly consumed; all when all are.
  [[nodiscard]] constexpr std::size_t known() const { return known_; }
  [[nodiscard]] constexpr std::size_t size() const { return size_; }
  [[nodiscard]] constexpr std::uint16_t high_water() const { return high_water_; }

 private:
  /// Index in samples_ of the i-th sample, i <= Capacity.
  [[nodiscard]] constexpr std::size_t place(std::size_t i) const {
    const std::size_t at = begin_ + i;
    return at < Capacity ? at : at - Capacity;
  }

  std::array<sensor::Sample, Capacity> samples_{};
  std::array<bool, Capacity> consumed_{};
  std::size_t begin_ = 0, size_ = 0;
  std::size_t known_ = 0, new_ = 0;  ///< places of consumed samples, and of those that are not
  std::uint16_t high_water_ = 0;
};

}  // namespace tetap::node
