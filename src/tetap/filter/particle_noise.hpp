// SPDX-License-Identifier: Apache-2.0
// The random numbers of a particle: a function of key, epoch and particle alone, so any draw can be repeated
// (counter-based generator, base/random.hpp). Normal numbers: Marsaglia & Tsang, "The ziggurat method for generating
// random variables", J. Stat. Software 5(8), 2000, with the layer's index and the value from different bits of the word
// (Doornik 2005).
#pragma once

#include "tetap/base/math.hpp"
#include "tetap/base/random.hpp"

#include <array>
#include <cstddef>
#include <cstdint>

namespace tetap::filter {

/// Purpose of a draw: the last word of the counter, so that no two purposes share a number.
enum class DrawFor : std::uint32_t { kMotion, kStart, kInjection, kResampling };

namespace detail {

inline constexpr int kLayers = 128;
inline constexpr float kZigguratEnd = 3.44261986F;   ///< where the tail begins (Marsaglia & Tsang 2000, sec. 3)
inline constexpr float kLayerArea = 9.91256304e-3F;  ///< area of a layer under exp(-x^2/2)

/// Layers of equal area under exp(-x^2/2), the base layer with the tail first.
struct Ziggurat {
  std::array<float, kLayers> width{};         ///< width of a layer over 2^31
  std::array<std::uint32_t, kLayers> sure{};  ///< a magnitude below is under the curve
  std::array<float, kLayers + 1> height{};    ///< the curve at the edge of a layer

  constexpr Ziggurat() {
    float x = kZigguratEnd, f = base::exp(-0.5F * x * x);
    const float base_width = kLayerArea / f;
    width[0] = base_width * 0x1p-31F;
    sure[0] = static_cast<std::uint32_t>(x / base_width * 0x1p31F);
    height[0] = 0.0F;
    height[1] = f;
    for (std::size_t i = 1; i < kLayers; ++i) {
      width[i] = x * 0x1p-31F;
      f = i + 1 < kLayers ? f + kLayerArea / x : 1.0F;
      const float inner = i + 1 < kLayers ? base::sqrt(-2.0F * base::log(f)) : 0.0F;
      sure[i] = static_cast<std::uint32_t>(inner / x * 0x1p31F);
      height[i + 1] = f;
      x = inner;
    }
  }
};
inline constexpr Ziggurat kZiggurat;

[[nodiscard]] constexpr float open_uniform(std::uint32_t word) {
  return (static_cast<float>(static_cast<std::int32_t>(word >> 8)) + 0.5F) * 0x1p-24F;
}

/// The 1.2 % of the draws that are not surely under the curve; each attempt has a block of the particle's own.
[[nodiscard, gnu::noinline]] constexpr float normal_edge(std::uint32_t word, std::uint32_t epoch,
                                                         std::uint32_t particle, std::uint32_t number,
                                                         base::PhiloxKey key) {
  constexpr std::uint32_t kEdge = 0x8000'0000U;  // beyond the blocks of normals_of()
  for (std::uint32_t attempt = 0; attempt < 64; ++attempt) {
    const std::uint32_t layer = word % kLayers;
    const auto whole = static_cast<std::int32_t>(word & ~(kLayers - 1U));
    const auto magnitude = static_cast<std::uint32_t>(whole < 0 ? -(whole + 1) : whole);
    const float x = static_cast<float>(whole) * kZiggurat.width[layer];
    if (magnitude < kZiggurat.sure[layer]) return x;
    const base::PhiloxCounter more = base::philox({epoch, particle, kEdge | number << 8 | attempt, 0}, key);
    if (layer == 0) {  // the tail beyond the end: Marsaglia 1964
      const float beyond = -base::log(open_uniform(more[1])) / kZigguratEnd;
      const float twice = -2.0F * base::log(open_uniform(more[2]));
      if (twice > beyond * beyond) return whole < 0 ? -(kZigguratEnd + beyond) : kZigguratEnd + beyond;
    } else {
      const float low = kZiggurat.height[layer], high = kZiggurat.height[layer + 1];
      if (low + open_uniform(more[1]) * (high - low) < base::exp(-0.5F * x * x)) return x;
    }
    word = more[0];
  }
  return 0.0F;
}

}  // namespace detail

/// Standard normal from one random word, number `number` of that particle in that epoch; where the word alone does not
/// decide, from further blocks.
[[nodiscard]] constexpr float normal_of(std::uint32_t word, std::uint32_t epoch, std::uint32_t particle,
                                        std::uint32_t number, const base::PhiloxKey& key) {
  const std::uint32_t layer = word % detail::kLayers;
  const auto whole = static_cast<std::int32_t>(word & ~(detail::kLayers - 1U));
  const auto magnitude = static_cast<std::uint32_t>(whole ^ (whole >> 31));
  if (magnitude < detail::kZiggurat.sure[layer]) [[likely]]
    return static_cast<float>(whole) * detail::kZiggurat.width[layer];
  return detail::normal_edge(word, epoch, particle, number, key);
}

/// In [0, 1), multiples of 2^-24.
[[nodiscard]] constexpr float uniform_of(std::uint32_t word) {
  return static_cast<float>(static_cast<std::int32_t>(word >> 8)) * 0x1p-24F;
}

/// kNormals standard normals of one particle in one epoch. Up to two come from half a block, which two neighbours
/// share; more from blocks of its own.
template <int kNormals>
[[nodiscard]] constexpr std::array<float, static_cast<std::size_t>(kNormals)> normals_of(base::PhiloxKey key,
                                                                                         std::uint32_t epoch,
                                                                                         std::uint32_t particle) {
  constexpr auto kPurpose = static_cast<std::uint32_t>(DrawFor::kMotion);
  std::array<float, static_cast<std::size_t>(kNormals)> normals{};
  if constexpr (kNormals <= 2) {
    const base::PhiloxCounter words = base::philox({epoch, particle / 2, 0, kPurpose}, key);
    for (std::size_t k = 0; k < normals.size(); ++k)
      normals[k] = normal_of(words[particle % 2 * 2 + k], epoch, particle, static_cast<std::uint32_t>(k), key);
  } else {
    for (std::size_t block = 0; 4 * block < normals.size(); ++block) {
      const base::PhiloxCounter words =
          base::philox({epoch, particle, static_cast<std::uint32_t>(block), kPurpose}, key);
      for (std::size_t k = 0; k < 4 && 4 * block + k < normals.size(); ++k)
        normals[4 * block + k] = normal_of(words[k], epoch, particle, static_cast<std::uint32_t>(4 * block + k), key);
    }
  }
  return normals;
}

/// Random numbers of one particle: words and normal numbers of its own, for a purpose other than motion.
struct Draw {
  base::PhiloxCounter words;
  std::uint32_t epoch = 0;
  std::uint32_t particle = 0;
  base::PhiloxKey key{};

  /// In [0, 1); k = 0 ... 3.
  [[nodiscard]] constexpr float uniform(std::uint32_t k) const { return uniform_of(words[k]); }
  /// From the same word as uniform(k).
  [[nodiscard]] constexpr float normal(std::uint32_t k) const { return normal_of(words[k], epoch, particle, k, key); }
};
[[nodiscard]] constexpr Draw draw_of(base::PhiloxKey key, std::uint32_t epoch, std::uint32_t particle,
                                     DrawFor purpose) {
  return {base::philox({epoch, particle, 0, static_cast<std::uint32_t>(purpose)}, key), epoch, particle, key};
}

}  // namespace tetap::filter
