// SPDX-License-Identifier: Apache-2.0
// Resampling of a weighted sample in place: how many copies of each particle survive, and their placement without a
// second array. Schemes: Douc & Cappe, "Comparison of resampling schemes for particle filtering", ISPA 2005;
// systematic: Carpenter, Clifford, Fearnhead 1999; residual: Liu & Chen 1998.
// Weights are integers, so sums are exact: the result has the same bits in any order of accumulation.
#pragma once

#include "tetap/base/random.hpp"

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>

namespace tetap::filter {

enum class Resampling : std::uint8_t { kSystematic, kStratified, kResidual, kMultinomial };

/// Bits of the largest weight: `most` of them add up to 2^31 at the most. The rounding moves no weight by more than
/// 2^-(bits + 1) of the largest.
[[nodiscard]] constexpr int weight_bits(std::size_t most) { return 31 - static_cast<int>(std::bit_width(most - 1)); }

[[nodiscard]] constexpr std::uint32_t sum_of_weights(std::span<const std::uint32_t> weights) {
  std::uint32_t sum = 0;
  for (const std::uint32_t w : weights) sum += w;
  return sum;
}

namespace detail {

/// A random word as an integer in [0, end).
[[nodiscard]] constexpr std::uint32_t below(std::uint32_t word, std::uint32_t end) {
  return static_cast<std::uint32_t>((std::uint64_t{word} * end) >> 32);
}

/// Implements docs/explanation/particle_filter.md (5).
/// Pointers at (offset + j sum) / wanted, j = 0 ... wanted - 1, over the cumulative weights: one word for all.
constexpr void systematic(std::span<const std::uint32_t> weights, std::uint32_t sum, std::uint32_t wanted,
                          std::uint32_t word, std::span<std::uint16_t> copies) {
  std::uint32_t rest = below(word, sum);
  for (std::size_t i = 0; i < weights.size(); ++i) {
    rest += weights[i] * wanted;  // below 2^32: the rest is below sum <= 2^31, and weight * wanted is at most 2^31
    const std::uint32_t whole = rest / sum;
    rest -= whole * sum;
    copies[i] = static_cast<std::uint16_t>(whole);
  }
}

/// Implements docs/explanation/particle_filter.md (6).
/// One pointer in each of `wanted` strata of equal weight, each with a word of its own.
constexpr void stratified(std::span<const std::uint32_t> weights, std::uint32_t sum, std::uint32_t wanted,
                          base::Random& random, std::span<std::uint16_t> copies) {
  std::uint64_t begin = 0, cumulative = 0;
  std::uint64_t pointer = below(random.next(), sum);
  std::uint32_t placed = 0;
  for (std::size_t i = 0; i < weights.size(); ++i) {
    copies[i] = 0;
    cumulative += std::uint64_t{weights[i]} * wanted;
    while (placed < wanted && pointer < cumulative) {
      ++copies[i];
      ++placed;
      begin += sum;
      pointer = begin + below(random.next(), sum);
    }
  }
}

/// `draws` independent pointers into the cumulative weights, each found by bisection. Weights become cumulative.
constexpr void multinomial(std::span<std::uint32_t> weights, std::uint32_t draws, base::Random& random,
                           std::span<std::uint16_t> copies) {
  std::uint32_t sum = 0;
  for (std::uint32_t& w : weights) w = sum += w;
  for (std::uint32_t k = 0; k < draws; ++k) {
    const std::uint32_t pointer = below(random.next(), sum);
    std::size_t low = 0, high = weights.size() - 1;
    while (low < high) {
      const std::size_t middle = (low + high) / 2;
      if (pointer < weights[middle]) {
        high = middle;
      } else {
        low = middle + 1;
      }
    }
    ++copies[low];
  }
}

/// Implements docs/explanation/particle_filter.md (7).
/// The whole part of each expected number of copies, and the rest of them by independent draws on what is left.
constexpr void residual(std::span<std::uint32_t> weights, std::uint32_t sum, std::uint32_t wanted, base::Random& random,
                        std::span<std::uint16_t> copies) {
  const auto shift = static_cast<int>(std::bit_width(weights.size() - 1));  // so that the remainders' sum fits a word
  std::uint32_t left = wanted;
  for (std::size_t i = 0; i < weights.size(); ++i) {
    const std::uint32_t expected = weights[i] * wanted;
    const std::uint32_t whole = expected / sum;
    copies[i] = static_cast<std::uint16_t>(whole);
    left -= whole;
    weights[i] = (expected - whole * sum) >> shift;
  }
  multinomial(weights, left, random, copies);
}

}  // namespace detail

/// Copies of each particle, `wanted` in all. `sum` is the sum of the weights, from 1 to 2^31; `wanted` times the
/// largest weight is at most 2^31, and the largest weight at least 2^15. The weights are overwritten.
constexpr void count_copies(Resampling scheme, std::span<std::uint32_t> weights, std::uint32_t sum,
                            std::uint32_t wanted, base::Random& random, std::span<std::uint16_t> copies) {
  switch (scheme) {
    case Resampling::kStratified:
      return detail::stratified(weights, sum, wanted, random, copies);
    case Resampling::kResidual:
      return detail::residual(weights, sum, wanted, random, copies);
    case Resampling::kMultinomial:
      for (std::size_t i = 0; i < weights.size(); ++i) copies[i] = 0;
      return detail::multinomial(weights, wanted, random, copies);
    case Resampling::kSystematic:
      return detail::systematic(weights, sum, wanted, random.next(), copies);
  }
}

/// Places the copies in the first `wanted` slots: a survivor keeps its slot, further copies overwrite the dead. Both
/// spans cover max(particles, wanted) entries; copies beyond the particles are zero.
template <class S>
constexpr void place_copies(std::span<S> states, std::span<std::uint16_t> copies, std::size_t wanted) {
  std::size_t free = 0;
  for (std::size_t i = 0; i < states.size(); ++i) {
    const std::uint16_t stays = i < wanted ? 1 : 0;
    while (copies[i] > stays) {
      while (copies[free] != 0) ++free;
      states[free] = states[i];
      copies[free] = 1;
      --copies[i];
    }
  }
}

}  // namespace tetap::filter
