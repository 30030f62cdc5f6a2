// SPDX-License-Identifier: Apache-2.0
// Counter-based random numbers: Philox4x32-10 (Salmon, Moraes, Dror, Shaw, "Parallel random numbers: as easy as 1, 2,
// 3", SC'11). The whole state is a key and a counter, so any draw can be repeated, and a stream per purpose costs
// nothing.
#pragma once

#include "tetap/base/math.hpp"

#include <array>
#include <cstdint>

namespace tetap::base {

using PhiloxCounter = std::array<std::uint32_t, 4>;
using PhiloxKey = std::array<std::uint32_t, 2>;

/// Ten rounds: the four words that belong to this counter under this key.
[[nodiscard]] constexpr PhiloxCounter philox(PhiloxCounter counter, PhiloxKey key) {
#pragma GCC unroll 10
  for (int round = 0; round < 10; ++round) {
    const std::uint64_t first = std::uint64_t{0xD2511F53U} * counter[0];
    const std::uint64_t second = std::uint64_t{0xCD9E8D57U} * counter[2];
    counter = {static_cast<std::uint32_t>(second >> 32) ^ counter[1] ^ key[0], static_cast<std::uint32_t>(second),
               static_cast<std::uint32_t>(first >> 32) ^ counter[3] ^ key[1], static_cast<std::uint32_t>(first)};
    key[0] += 0x9E3779B9U;
    key[1] += 0xBB67AE85U;
  }
  return counter;
}

class Random {
 public:
  explicit constexpr Random(std::uint64_t seed, std::uint64_t stream = 0)
      : key_{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32)},
        stream_{static_cast<std::uint32_t>(stream), static_cast<std::uint32_t>(stream >> 32)} {}

  /// The next 32 random bits.
  constexpr std::uint32_t next() {
    if (drawn_ % 4 == 0) {
      const std::uint64_t block = drawn_ / 4;
      words_ = philox(
          {static_cast<std::uint32_t>(block), static_cast<std::uint32_t>(block >> 32), stream_[0], stream_[1]}, key_);
    }
    return words_[drawn_++ % 4];
  }
  /// In [0, 1), multiples of 2^-24.
  constexpr float uniform() { return static_cast<float>(static_cast<std::int32_t>(next() >> 8)) * 0x1p-24F; }
  /// In (0, 1], multiples of 2^-24.
  constexpr float uniform_positive() {
    return static_cast<float>(static_cast<std::int32_t>(next() >> 8) + 1) * 0x1p-24F;
  }
  /// Standard normal, by Box & Muller (Ann. Math. Stat. 29(2), 1958) from our own log, sqrt and cos: two words each;
  /// |value| < 5.8.
  constexpr float normal() {
    const float radius = sqrt(-2.0F * log(uniform_positive()));
    return radius * cos(6.28318531F * uniform());
  }

  /// How many words were drawn: with seed and stream the whole state.
  [[nodiscard]] constexpr std::uint64_t drawn() const { return drawn_; }

 private:
  PhiloxKey key_;
  std::array<std::uint32_t, 2> stream_;
  std::uint64_t drawn_ = 0;
  PhiloxCounter words_{};
};

}  // namespace tetap::base
