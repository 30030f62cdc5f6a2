// SPDX-License-Identifier: Apache-2.0
// A 32-bit hash over the raw bits of numbers, a word at a time: it shows whether two machines hold the same state.
// Each word costs an exclusive or, a multiplication by an odd number and a shifted exclusive or, each of which can be
// undone. Two states that differ in one word therefore never have the same hash. Multiplier: Fibonacci hashing (Knuth,
// The Art of Computer Programming 3, 6.4); last step: fmix32 (Appleby, MurmurHash3).
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace tetap::base {

class StateHash {
 public:
  constexpr void operator()(std::uint32_t word) { state_ = mixed(state_, word); }
  constexpr void operator()(std::int32_t word) { (*this)(static_cast<std::uint32_t>(word)); }
  constexpr void operator()(float number) { (*this)(std::bit_cast<std::uint32_t>(number)); }
  constexpr void operator()(std::int64_t word) {
    (*this)(static_cast<std::uint32_t>(static_cast<std::uint64_t>(word)));
    (*this)(static_cast<std::uint32_t>(static_cast<std::uint64_t>(word) >> 32));
  }
  /// The words that lie in memory from `from` on.
  [[gnu::noinline]] void run(const void* from, std::size_t count) {
    const auto* bytes = static_cast<const unsigned char*>(from);
    std::uint32_t state = state_;
#pragma GCC unroll 4
    for (std::size_t i = 0; i < count; ++i) {
      std::uint32_t word = 0;
      std::memcpy(&word, bytes + i * sizeof word, sizeof word);
      state = mixed(state, word);
    }
    state_ = state;
  }
  /// Every bit of the state spread over all bits of the value.
  [[nodiscard]] constexpr std::uint32_t value() const {
    std::uint32_t h = state_;
    h = (h ^ (h >> 16)) * 0x85EBCA6BU;
    h = (h ^ (h >> 13)) * 0xC2B2AE35U;
    return h ^ (h >> 16);
  }

 private:
  [[nodiscard]] static constexpr std::uint32_t mixed(std::uint32_t state, std::uint32_t word) {
    const std::uint32_t product = (state ^ word) * kGoldenRatio;
    return product ^ (product >> 15);
  }
  static constexpr std::uint32_t kGoldenRatio = 0x9E3779B1U;  ///< 2^32 divided by the golden ratio, the next odd prime
  std::uint32_t state_ = kGoldenRatio;                        ///< not 0, so that leading zeros count
};

}  // namespace tetap::base
