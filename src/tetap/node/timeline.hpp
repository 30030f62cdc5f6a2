// SPDX-License-Identifier: Apache-2.0
// Samples in the order in which they were true: those waiting for their tick, and the recent past. The past is kept so
// that a late sample can still be fused at its own time. The order is a ring of numbers: what leaves at the front moves
// nothing, and what comes between moves no sample.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/base/state_hash.hpp"
#include "tetap/sensor/sample.hpp"
#include "tetap/sensor/window.hpp"

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
    const std::size_t at = place_for(sample);
    if (size_ - at > moves) return Insert::kTooMuch;
    moves = size_ - at;
    if (at > 0 && (*this)[at - 1].order(sample) == 0) {
      // Two that claim to be one sample and differ: the one whose frames have the smaller sum, whichever came first.
      if (!consumed(at - 1) && sample.bits < (*this)[at - 1].bits) {
        digest_ += digest_of(sample) - digest_of((*this)[at - 1]);
        samples_[number(at - 1)] = sample;
      }
      return Insert::kDuplicate;
    }
    if (size_ == Capacity) return Insert::kFull;
    const std::size_t to = place(at);
    const std::size_t end = place(size_);
    const std::uint16_t free = order_[end];
    if (to <= end) {
      shift(to, end);
    } else {  // around the end of the ring
      shift(0, end);
      order_[0] = order_[Capacity - 1];
      shift(to, Capacity - 1);
    }
    order_[to] = free;
    samples_[free] = sample;
    consumed_[free] = 0;
    digest_ += digest_of(sample);
    ++size_;
    ++new_;
    if (at < known_) known_ = at;
    if (size_ > high_water_) high_water_ = static_cast<std::uint16_t>(size_);
    return Insert::kTaken;
  }

  /// Inserts without a limit of moves.
  [[nodiscard]] constexpr Insert insert(const sensor::Sample& sample) {
    std::size_t moves = Capacity;
    return insert(sample, moves);
  }

  /// Number of samples with a stamp <= t.
  [[nodiscard]] constexpr std::size_t until(base::Micros t) const {
    std::size_t n = size_;
    while (n > 0 && (*this)[n - 1].stamp > t) --n;
    return n;
  }

  constexpr void drop_front(std::size_t count) {
    for (std::size_t i = known_; i < count; ++i) new_ -= consumed(i) ? 0 : 1;
    for (std::size_t i = 0; i < count; ++i) digest_ -= digest_of((*this)[i]);
    begin_ = place(count);
    size_ -= count;
    known_ = new_ == 0 ? size_ : known_ > count ? known_ - count : 0;
  }
  constexpr void clear() { size_ = known_ = new_ = 0, digest_ = 0; }
  constexpr void power_on() {
    clear(), begin_ = 0, high_water_ = 0;
    for (std::size_t i = 0; i < Capacity; ++i) order_[i] = static_cast<std::uint16_t>(i);
  }

  /// Digest of the content: the sum of what its samples give, modulo 2^32, kept up to date by what comes and goes. The
  /// stamps are the order, and a sample's payload is in its frames' CRC already, so this one only has to identify the
  /// samples.
  [[nodiscard]] constexpr std::uint32_t digest() const { return digest_ + static_cast<std::uint32_t>(size_); }

  /// First `size` samples of the timeline.
  [[nodiscard]] constexpr sensor::Window window(std::size_t size) const {
    return {samples_.data(), order_.data(), Capacity, begin_, size};
  }
  [[nodiscard]] constexpr const sensor::Sample& operator[](std::size_t i) const { return samples_[number(i)]; }
  /// The current estimate has it, and its record went out.
  [[nodiscard]] constexpr bool consumed(std::size_t i) const { return (consumed_[number(i)] & 1U) != 0; }
  constexpr void consume(std::size_t i) {
    if (consumed(i)) return;
    consumed_[number(i)] = static_cast<std::uint8_t>(consumed_[number(i)] | 1U);
    --new_;
    if (i == known_) ++known_;
    if (new_ == 0) known_ = size_;
  }
  /// Estimator `slot` does not have the consumed sample yet: its record is to come.
  constexpr void await(std::size_t i, std::size_t slot) {
    consumed_[number(i)] = static_cast<std::uint8_t>(consumed_[number(i)] | 2U << slot);
  }
  /// Whether the estimator's record was to come; once.
  [[nodiscard]] constexpr bool take_awaited(std::size_t i, std::size_t slot) {
    std::uint8_t& state = consumed_[number(i)];
    const bool awaited = (state & (2U << slot)) != 0;
    if (awaited) state = static_cast<std::uint8_t>(state & ~(2U << slot));
    return awaited;
  }
  /// Number of samples at the front that are certainly consumed; all when all are.
  [[nodiscard]] constexpr std::size_t known() const { return known_; }
  /// False: nothing new belongs before a consumed sample.
  [[nodiscard]] constexpr bool any_late() const { return new_ != size_ - known_; }
  [[nodiscard]] constexpr std::size_t size() const { return size_; }
  [[nodiscard]] constexpr std::uint16_t high_water() const { return high_water_; }
  /// The numbers in order_ and the high-water mark depend on the order of arrival; a wrong number shows as another
  /// sample, the mark goes out in Est_Diag.
  static constexpr auto members(auto& self) {
    return base::members(base::ring(self.samples_, self.begin_, self.size_, self.order_), base::unhashed(self.order_),
                         base::ring(self.consumed_, self.begin_, self.size_, self.order_), base::count(self.begin_),
                         base::count(self.size_), base::count(self.known_), base::count(self.new_), self.digest_,
                         base::unhashed(self.high_water_));
  }

 private:
  [[nodiscard]] static constexpr std::uint32_t digest_of(const sensor::Sample& sample) {
    base::StateHash hash;
    hash(sample.stamp.us);
    hash(sample.bits);
    return hash.value();
  }
  /// How many samples are not behind this one: most come last or nearly so, any other place is found by halves.
  [[nodiscard]] constexpr std::size_t place_for(const sensor::Sample& sample) const {
    const auto behind = [&](std::size_t i) { return (*this)[i].order(sample) > 0; };
    std::size_t high = size_;
    for (int near = 3; near > 0; --near, --high)
      if (high == 0 || !behind(high - 1)) return high;
    std::size_t low = 0;
    while (low < high) {
      const std::size_t middle = (low + high) / 2;
      if (behind(middle)) {
        high = middle;
      } else {
        low = middle + 1;
      }
    }
    return high;
  }
  /// Numbers from `from` to before `to` go one place on.
  constexpr void shift(std::size_t from, std::size_t to) {
    for (std::uint16_t* at = order_.data() + to; at != order_.data() + from; --at) *at = *(at - 1);
  }
  /// Place in order_ of the i-th sample, i <= Capacity.
  [[nodiscard]] constexpr std::size_t place(std::size_t i) const {
    const std::size_t at = begin_ + i;
    return at < Capacity ? at : at - Capacity;
  }

  [[nodiscard]] constexpr std::size_t number(std::size_t i) const { return order_[place(i)]; }

  std::array<sensor::Sample, Capacity> samples_{};
  /// Numbers in samples_ in the order of the stamps, from begin_ on; behind them those of free places.
  std::array<std::uint16_t, Capacity> order_ = [] {
    std::array<std::uint16_t, Capacity> order{};
    for (std::size_t i = 0; i < Capacity; ++i) order[i] = static_cast<std::uint16_t>(i);
    return order;
  }();
  std::array<std::uint8_t, Capacity>
      consumed_{};  ///< bit 0: consumed; bit 1 + slot: that estimator's record is to come
  std::size_t begin_ = 0, size_ = 0;
  std::size_t known_ = 0, new_ = 0;  ///< places of consumed samples, and of those that are not
  std::uint32_t digest_ = 0;         ///< sum of the samples' digests
  std::uint16_t high_water_ = 0;
};

}  // namespace tetap::node
