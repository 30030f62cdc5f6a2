// SPDX-License-Identifier: Apache-2.0
// exp and log in float, from + - * / and integers in one fixed order: the same bits on every target.
// Reduction by multiples of ln 2 in two parts; exp by a polynomial, log by log(1+f) = 2 atanh(f / (2+f)) with the exact
// f taken out (P. T. P. Tang, ACM TOMS 16(4), 1990, has the idea). Coefficients as in trig.hpp. Errors:
// test/base/math_test.cpp.
#pragma once

#include "tetap/base/float_bits.hpp"

namespace tetap::base {

namespace detail {

inline constexpr float kLn2 = 0x1.62e4p-1F;  // 15 bits, so n times it is exact for |n| < 512
inline constexpr float kLn2Low = 0x1.7f7d1cp-20F;

/// exp(x) = value * 2^(power modulo 2^9), value in [0.7, 1.42], for |x| < 104.
struct Scaled {
  float value;
  std::uint32_t power;
};

[[nodiscard]] constexpr Scaled exp_scaled(float x) {
  constexpr float kRound = 0x1.8p+23F;  // adding it leaves the nearest integer in the low bits of the sum
  const float shifted = x * 0x1.715476p+0F + kRound;
  const float n = shifted - kRound;
  const float r = (x - n * kLn2) - n * kLn2Low;
  const float p =
      0x1.fffffcp-2F + r * (0x1.55549p-3F + r * (0x1.55589ep-5F + r * (0x1.123abcp-7F + r * 0x1.6a624cp-10F)));
  return {1.0F + (r + r * r * p), bits(shifted)};
}

/// exp near and beyond the ends of the range, and of NaN.
[[nodiscard, gnu::noinline]] constexpr float exp_far(float x) {
  const std::uint32_t u = bits(x);
  if (is_nan(x)) return kNan;
  if (u < kSignBit && u > 0x42b1'7217U) return kInfinity;          // 88.72284: above 2^128 less half a place
  if (u > kSignBit && u > (kSignBit | 0x42cf'f1b4U)) return 0.0F;  // -103.97208: below 2^-150
  const Scaled y = exp_scaled(x);
  if (u < kSignBit) return from_bits(bits(y.value) + (y.power << 23));
  return from_bits(bits(y.value) + ((y.power + 64U) << 23)) * 0x1p-64F;  // one rounding, to a subnormal
}

/// log(x) for x = mantissa bits u of a normal number, times 2^bias.
[[nodiscard]] constexpr float log_normal(std::uint32_t u, std::int32_t bias) {
  constexpr std::uint32_t kSqrtHalf = 0x3f35'04f3U;
  const std::uint32_t shifted = u + (0x3f80'0000U - kSqrtHalf);
  const auto k = static_cast<float>(static_cast<std::int32_t>(shifted >> 23) - 127 + bias);
  const float f = from_bits((shifted & 0x007f'ffffU) + kSqrtHalf) - 1.0F;  // exact; in [sqrt(1/2) - 1, sqrt(2) - 1]
  const float s = f / (2.0F + f);
  const float z = s * s;
  const float series = z * (0x1.55557ap-1F + z * (0x1.995ed6p-2F + z * 0x1.31e096p-2F));
  const float half = 0.5F * f * f;
  return k * kLn2 + (f - (half - (s * (half + series) + k * kLn2Low)));
}

/// log of zero, subnormals, negatives, infinity and NaN.
[[nodiscard, gnu::noinline]] constexpr float log_far(float x) {
  const std::uint32_t u = bits(x);
  if ((u & ~kSignBit) == 0) return -kInfinity;
  if (u > kInfinityBits) return kNan;
  return u == kInfinityBits ? kInfinity : log_normal(bits(x * 0x1p+23F), -23);
}

}  // namespace detail

/// Within 1.5 ulp for every float, subnormal results included; kInfinity above 88.72284, 0 below -103.97208.
[[nodiscard]] constexpr float exp(float x) {
  if ((bits(x) & ~kSignBit) > bits(87.0F)) return detail::exp_far(x);
  const detail::Scaled y = detail::exp_scaled(x);
  return from_bits(bits(y.value) + (y.power << 23));
}

/// Within 1.5 ulp for every float, subnormal arguments included; log(+-0) = -kInfinity, kNan below.
[[nodiscard]] constexpr float log(float x) {
  const std::uint32_t u = bits(x);
  if (u - 0x0080'0000U >= kInfinityBits - 0x0080'0000U) return detail::log_far(x);
  return detail::log_normal(u, 0);
}

}  // namespace tetap::base
