// SPDX-License-Identifier: Apache-2.0
// The parts of a float, and the helpers whose answer for NaN, infinity and signed zero is the same on every target.
// IEEE 754-2008 binary32. Tests look at the bits, so they hold whatever the compiler assumes about NaN.
#pragma once

#include <bit>
#include <cstdint>
#include <limits>
#include <type_traits>

namespace tetap::base {

static_assert(std::numeric_limits<float>::is_iec559 && sizeof(float) == 4);

[[nodiscard]] constexpr std::uint32_t bits(float x) { return std::bit_cast<std::uint32_t>(x); }
[[nodiscard]] constexpr float from_bits(std::uint32_t u) { return std::bit_cast<float>(u); }

inline constexpr std::uint32_t kSignBit = 0x8000'0000U;
inline constexpr std::uint32_t kInfinityBits = 0x7f80'0000U;

/// The only NaN these headers return. x86 makes ffc00000 out of 0/0, ARM 7fc00000: left alone, every hash would differ.
inline constexpr float kNan = from_bits(0x7fc0'0000U);
inline constexpr float kInfinity = from_bits(kInfinityBits);

inline constexpr float kPi = 0x1.921fb6p+1F;       ///< nearest float; 8.7e-8 above pi
inline constexpr float kHalfPi = 0x1.921fb6p+0F;   ///< nearest float; 4.4e-8 above pi/2
inline constexpr float kPiLow = -0x1.777a5cp-24F;  ///< pi - kPi
inline constexpr float kHalfPiLow = -0x1.777a5cp-25F;

[[nodiscard]] constexpr bool is_nan(float x) { return (bits(x) & ~kSignBit) > kInfinityBits; }
[[nodiscard]] constexpr bool is_finite(float x) { return (bits(x) & ~kSignBit) < kInfinityBits; }

/// x, or kNan for any NaN: to be used wherever a computed float is hashed, compared or sent.
[[nodiscard]] constexpr float canonical_nan(float x) { return is_nan(x) ? kNan : x; }

/// |x|; a NaN becomes kNan.
[[nodiscard]] constexpr float abs(float x) { return is_nan(x) ? kNan : from_bits(bits(x) & ~kSignBit); }

/// The smaller; -0 is smaller than +0. A NaN on either side gives kNan: a limit must never hide a divergence.
[[nodiscard]] constexpr float min(float a, float b) {
  if (is_nan(a) || is_nan(b)) return kNan;
  if (a < b) return a;
  return b < a ? b : from_bits(bits(a) | bits(b));  // equal: the same bits, or zeros of either sign
}

/// The larger; +0 is larger than -0. A NaN on either side gives kNan.
[[nodiscard]] constexpr float max(float a, float b) {
  if (is_nan(a) || is_nan(b)) return kNan;
  if (a > b) return a;
  return b > a ? b : from_bits(bits(a) & bits(b));
}

/// x limited to [low, high]; kNan if any of the three is NaN; `high` if low > high.
[[nodiscard]] constexpr float clamp(float x, float low, float high) { return min(max(x, low), high); }

namespace detail {

/// Correctly rounded square root of a positive finite float by integers: for constant expressions, where the
/// instruction is not at hand.
[[nodiscard]] constexpr float sqrt_by_integers(std::uint32_t u) {
  const int shift = std::countl_zero(u) - 8;  // subnormals are normalised, normals keep their implicit bit
  std::uint64_t m = u >> 23 == 0 ? u << shift : (u & 0x007f'ffffU) | 0x0080'0000U;
  int e = (u >> 23 == 0 ? 1 - shift : static_cast<int>(u >> 23)) - 150;
  if (e % 2 == 0) m <<= 1, e -= 1;
  const std::uint64_t square = m << 25;  // in [2^48, 2^50), so the root has 25 bits: one more than the result
  std::uint64_t root = 0;
  for (std::uint64_t bit = 1U << 24; bit != 0; bit >>= 1)
    if ((root | bit) * (root | bit) <= square) root |= bit;
  // An odd root is above the half or exact to 25 bits; the latter cannot be, the square of an odd number being odd.
  const auto rounded = static_cast<std::uint32_t>((root + 1) >> 1);
  return from_bits((static_cast<std::uint32_t>((e - 25) / 2 + 150) << 23) + rounded);
}

}  // namespace detail

/// Correctly rounded; sqrt(-0) = -0, negative gives kNan.
[[nodiscard]] constexpr float sqrt(float x) {
  const std::uint32_t u = bits(x);
  if (u > kInfinityBits && u != kSignBit) return kNan;
  if (std::is_constant_evaluated()) return (u & ~kSignBit) == 0 || u == kInfinityBits ? x : detail::sqrt_by_integers(u);
  return __builtin_sqrtf(x);
}

}  // namespace tetap::base
