// SPDX-License-Identifier: Apache-2.0
// Number of particles that a distribution needs: KLD sampling, with the occupied bins in a fixed set. Source: D. Fox,
// "Adapting the sample size in particle filters through KLD-sampling", IJRR 22(12), 2003, eq. 13.
#pragma once

#include "tetap/base/math.hpp"

#include <array>
#include <cstddef>
#include <cstdint>

namespace tetap::filter {

/// A set of bins. Bin numbers may be any words, spread by the caller's geometry. Two bins that fall on one bit count
/// once: the number of bins comes out low by about k^2 / (2 kBits).
template <std::size_t kBits>
class BinSet {
 public:
  static_assert(kBits % 32 == 0);

  /// Bin of three whole coordinates: multiplicative hashing (Teschner et al. 2003, sec. 3.1) with a final mixing.
  [[nodiscard]] static constexpr std::uint32_t bin(std::int32_t x, std::int32_t y, std::int32_t z) {
    std::uint32_t h = static_cast<std::uint32_t>(x) * 73'856'093U ^ static_cast<std::uint32_t>(y) * 19'349'663U ^
                      static_cast<std::uint32_t>(z) * 83'492'791U;
    h = (h ^ (h >> 16)) * 0x7feb'352dU;
    return h ^ (h >> 15);
  }
  constexpr void clear() {
    words_ = {};
    count_ = 0;
  }
  constexpr void add(std::uint32_t bin) {
    const std::uint32_t place = bin % kBits;
    const std::uint32_t bit = 1U << (place % 32);
    if ((words_[place / 32] & bit) != 0) return;
    words_[place / 32] |= bit;
    ++count_;
  }
  [[nodiscard]] constexpr std::size_t count() const { return count_; }

 private:
  std::array<std::uint32_t, kBits / 32> words_{};
  std::size_t count_ = 0;
};

/// Implements docs/explanation/particle_filter.md (8).
/// Number of particles for `bins` occupied bins, limited to [least, most]. With it the Kullback-Leibler distance
/// between sample and distribution stays below `error`, with the probability of the normal quantile `quantile`.
[[nodiscard]] constexpr std::size_t particles_for(std::size_t bins, float error, float quantile, std::size_t least,
                                                  std::size_t most) {
  if (bins < 2) return least;
  const float k = static_cast<float>(static_cast<std::int32_t>(bins - 1));
  const float a = 2.0F / (9.0F * k);
  const float root = 1.0F - a + base::sqrt(a) * quantile;
  const float wanted = k / (2.0F * error) * root * root * root;
  if (!(wanted > static_cast<float>(static_cast<std::int32_t>(least)))) return least;
  if (!(wanted < static_cast<float>(static_cast<std::int32_t>(most)))) return most;
  return static_cast<std::size_t>(static_cast<std::int32_t>(wanted));
}

}  // namespace tetap::filter
