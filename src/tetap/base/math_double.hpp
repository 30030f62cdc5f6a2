// SPDX-License-Identifier: Apache-2.0
// The elementary functions in double, to 2 ulp: for geodesy, and for tests that judge. Same rule: + - * / sqrt and
// integers in one fixed order. Methods: Cody & Waite reduction (1980, ch. 8), Taylor and minimax series; log by 2
// atanh(f/(2+f)) (Tang, ACM TOMS 16(4), 1990).
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <limits>
#include <type_traits>

namespace tetap::base {

struct SinCosDouble {
  double sin = 0, cos = 1;
};

namespace detail {

inline constexpr double kNanDouble = std::numeric_limits<double>::quiet_NaN();
inline constexpr double kInfinityDouble = std::numeric_limits<double>::infinity();
[[nodiscard]] constexpr std::uint64_t double_bits(double x) { return std::bit_cast<std::uint64_t>(x); }
[[nodiscard]] constexpr double double_from(std::uint64_t u) { return std::bit_cast<double>(u); }
inline constexpr std::uint64_t kSignDouble = std::uint64_t{1} << 63;
inline constexpr std::uint64_t kInfinityBitsDouble = std::uint64_t{0x7ff} << 52;
[[nodiscard]] constexpr bool is_finite_double(double x) {
  return (double_bits(x) & ~kSignDouble) < kInfinityBitsDouble;
}
[[nodiscard]] constexpr bool is_nan_double(double x) { return (double_bits(x) & ~kSignDouble) > kInfinityBitsDouble; }

/// 1 / k!, correctly rounded; in [0] to [1]: 1.
inline constexpr std::array<double, 19> kInverseFactorial = [] {
  std::array<double, 19> inverse{};
  double factorial = 1;
  for (std::size_t k = 0; k < inverse.size(); ++k) {
    if (k > 1) factorial *= static_cast<double>(k);
    inverse[k] = 1.0 / factorial;
  }
  return inverse;
}();
/// 1/First! - z/(First + 2)! + ... +- z^n/Last!, by Horner's rule: a product is a tenth of a division without an FPU.
template <std::size_t First, std::size_t Last>
[[nodiscard]] constexpr double alternating_series(double z) {
  double p = kInverseFactorial[Last];
  for (std::size_t k = Last; k > First; k -= 2) p = kInverseFactorial[k - 2] - z * p;
  return p;
}
/// sin on |hi + lo| <= pi/4.
[[nodiscard]] constexpr double sin_series(double hi, double lo) {
  const double z = hi * hi;
  return hi + (lo * (1.0 - 0.5 * z) - hi * z * alternating_series<3, 17>(z));
}
[[nodiscard]] constexpr double cos_series(double hi, double lo) {
  const double z = hi * hi;
  const double half = 0.5 * z;
  const double head = 1.0 - half;
  return head + (((1.0 - head) - half) + (z * z * alternating_series<4, 18>(z) - hi * lo));
}

}  // namespace detail

namespace detail {

/// Correctly rounded, digit by digit in integers: for constant expressions, and for cores without a double-precision
/// unit.
[[nodiscard]] constexpr double sqrt_by_integers(double x) {
  std::uint64_t u = double_bits(x);
  if ((u & ~kSignDouble) == 0 || u == kInfinityBitsDouble) return x;
  if (u > kInfinityBitsDouble) return kNanDouble;
  std::int32_t bias = 0;
  if (u < std::uint64_t{1} << 52) u = double_bits(x * 0x1p+54), bias = -54;
  const auto exponent = static_cast<std::int32_t>(u >> 52) - 1023 + bias;
  std::uint64_t mantissa = (u & 0x000f'ffff'ffff'ffffU) | (std::uint64_t{1} << 52);
  const std::int32_t half = exponent >= 0 ? exponent / 2 : (exponent - 1) / 2;  // downwards
  if (exponent != 2 * half) mantissa <<= 1;
  std::uint64_t root = 0;
  std::uint64_t rest = 0;
  for (int pair = 26; pair >= -27; --pair) {  // 54 digits: one more than the result has
    rest = (rest << 2) | (pair >= 0 ? (mantissa >> (2 * pair)) & 3U : 0U);
    const std::uint64_t trial = (root << 2) | 1U;
    root <<= 1;
    if (rest >= trial) rest -= trial, root |= 1U;
  }
  // An odd root is above the half: a tie would need 54 digits exactly, and their square has 107.
  return double_from((((root + 1) >> 1) & 0x000f'ffff'ffff'ffffU) + (static_cast<std::uint64_t>(half + 1023) << 52) +
                     ((((root + 1) >> 1) >> 53) << 52));
}

}  // namespace detail

/// Correctly rounded; sqrt(-0) = -0, negative gives NaN.
[[nodiscard]] constexpr double sqrt(double x) {
#if !defined(__ARM_FP) || (__ARM_FP & 8) != 0
  const std::uint64_t u = detail::double_bits(x);
  if (u > detail::kInfinityBitsDouble && u != detail::kSignDouble)
    return detail::kNanDouble;  // the instruction keeps a NaN's payload
  if (!std::is_constant_evaluated()) return __builtin_sqrt(x);
#endif
  return detail::sqrt_by_integers(x);
}

/// |x| <= 2^20; beyond, and for NaN and infinity, both are NaN. sin(-0) = -0.
[[nodiscard]] constexpr SinCosDouble sincos(double x) {
  if (!(x <= 1048576.0 && x >= -1048576.0)) return {detail::kNanDouble, detail::kNanDouble};
  if (detail::double_bits(x) << 1 == 0) return {x, 1.0};  // the sums below would lose the sign of zero
  constexpr double kRound = 0x1.8p+52;
  const double n = (x * 0x1.45f306dc9c883p-1 + kRound) - kRound;
  // pi/2 in parts of 33 bits: n (21 bits) times the first two is exact.
  constexpr double kFirst = 0x1.921fb54400000p+0, kSecond = 0x1.0b4611a600000p-34, kThird = 0x1.3198a2e037073p-69;
  const double r = x - n * kFirst;
  const double s = r - n * kSecond;
  const double w = n * kThird - ((r - s) - n * kSecond);
  const double hi = s - w;
  const double lo = (s - hi) - w;
  const double sine = detail::sin_series(hi, lo);
  const double cosine = detail::cos_series(hi, lo);
  const auto quadrant = static_cast<std::uint32_t>(static_cast<std::int32_t>(n)) & 3U;
  const double sin_value = (quadrant & 1U) != 0 ? cosine : sine;
  const double cos_value = (quadrant & 1U) != 0 ? sine : cosine;
  return {(quadrant & 2U) != 0 ? -sin_value : sin_value, ((quadrant + 1U) & 2U) != 0 ? -cos_value : cos_value};
}
[[nodiscard]] constexpr double sin(double x) { return sincos(x).sin; }
[[nodiscard]] constexpr double cos(double x) { return sincos(x).cos; }

/// exp; overflow gives infinity, underflow runs through the subnormals to 0.
[[nodiscard]] constexpr double exp(double x) {
  if (detail::is_nan_double(x)) return detail::kNanDouble;
  if (x > 709.782712893384) return detail::kInfinityDouble;
  if (x < -745.2) return 0.0;
  constexpr double kRound = 0x1.8p+52;
  const double n = (x * 0x1.71547652b82fep+0 + kRound) - kRound;
  const double hi = x - n * 0x1.62e42fee00000p-1;
  const double lo = n * 0x1.a39ef35793c76p-33;
  const double r = hi - lo;
  const double tail = (hi - r) - lo;
  double p = 1.0 / 14.0;
  for (double k = 13.0; k > 2.0; k -= 1.0) p = (1.0 + r * p) / k;
  p = 0.5 * (1.0 + r * p);
  const double value = 1.0 + (r + (r * r * p + tail));
  const auto power = static_cast<std::int32_t>(n);
  const auto scale = [](std::int32_t k) { return detail::double_from(static_cast<std::uint64_t>(k + 1023) << 52); };
  return value * scale(power / 2) * scale(power - power / 2);
}

/// log; log(+-0) = -infinity, NaN below.
[[nodiscard]] constexpr double log(double x) {
  std::uint64_t u = detail::double_bits(x);
  if ((u & ~detail::kSignDouble) == 0) return -detail::kInfinityDouble;
  if (u > detail::kInfinityBitsDouble) return detail::kNanDouble;
  if (u == detail::kInfinityBitsDouble) return x;
  std::int32_t bias = 0;
  if (u < std::uint64_t{1} << 52) u = detail::double_bits(x * 0x1p+54), bias = -54;
  constexpr std::uint64_t kSqrtHalf = 0x3fe6'a09e'667f'3bcdU;
  const std::uint64_t shifted = u + (0x3ff0'0000'0000'0000U - kSqrtHalf);
  const auto k = static_cast<double>(static_cast<std::int32_t>(shifted >> 52) - 1023 + bias);
  const double f = detail::double_from((shifted & 0x000f'ffff'ffff'ffffU) + kSqrtHalf) - 1.0;
  const double s = f / (2.0 + f);
  const double z = s * s;
  double series = 0;
  for (double n = 25.0; n > 1.0; n -= 2.0) series = z * (2.0 / n + series);
  const double half = 0.5 * f * f;
  return k * 0x1.62e42fee00000p-1 - ((half - (s * (half + series) + k * 0x1.a39ef35793c76p-33)) - f);
}

/// Angle of (x, y); special cases as in ISO C annex F.
[[nodiscard]] constexpr double atan2(double y, double x) {
  constexpr double kHalfTurn = 0x1.921fb54442d18p+1, kHalfTurnLow = 0x1.1a62633145c07p-53;
  if (detail::is_nan_double(x) || detail::is_nan_double(y)) return detail::kNanDouble;
  const bool left = (detail::double_bits(x) & detail::kSignDouble) != 0;
  const std::uint64_t sign = detail::double_bits(y) & detail::kSignDouble;
  const double ax = detail::double_from(detail::double_bits(x) & ~detail::kSignDouble);
  const double ay = detail::double_from(detail::double_bits(y) & ~detail::kSignDouble);
  const auto with_sign = [sign](double angle) { return detail::double_from(detail::double_bits(angle) | sign); };
  if (ay <= 0.0) return with_sign(left ? kHalfTurn : 0.0);
  if (!detail::is_finite_double(ax) || !detail::is_finite_double(ay)) {
    if (!detail::is_finite_double(ax) && !detail::is_finite_double(ay))
      return with_sign(left ? 0.75 * kHalfTurn : 0.25 * kHalfTurn);
    return with_sign(!detail::is_finite_double(ay) ? 0.5 * kHalfTurn : left ? kHalfTurn : 0.0);
  }
  const bool steep = ay > ax;
  double high = steep ? ay : ax;
  double low = steep ? ax : ay;
  if (high > 0x1p+1000) high *= 0x1p-60, low *= 0x1p-60;
  if (high < 0x1p-900) high *= 0x1p+100, low *= 0x1p+100;
  // Beyond tan(pi/8) the angle is taken from the diagonal: atan(q) = pi/4 + atan((low - high)/(low + high)).
  const bool diagonal = low > 0.41421356237309503 * high;
  const double top = diagonal ? low - high : low;
  const double bottom = diagonal ? low + high : high;
  const double q = top / bottom;
  const double z = q * q;
  // Rounding errors of sum and difference (exact, as |high| >= |low|): without them a whole place would be lost.
  const double lost = diagonal ? ((low - (top + high)) - q * (low - (bottom - high))) / (bottom + bottom * z) : 0.0;
  double p = 0;
  for (const double c :
       {-0x1.a933ba46b543ep-7, 0x1.e51628ad085b9p-6, -0x1.4c2db6e3358f1p-5, 0x1.817a9cddcf63fp-5, -0x1.ae89003812f0bp-5,
        0x1.e1d2a07610252p-5, -0x1.11108cb6d07bfp-4, 0x1.3b13aaf7cfbd5p-4, -0x1.745d171266892p-4, 0x1.c71c71c60c87bp-4,
        -0x1.2492492490a05p-3, 0x1.9999999999970p-3, -0x1.5555555555555p-2})
    p = c + z * p;
  const double more = q * z * p + lost;
  if (!diagonal && !steep && !left) return with_sign(q + more);
  // base + turn * (q + more), the base in two parts; quarter turns are exact multiples of kHalfTurn's parts.
  const double quarters = diagonal ? 1.0 : 0.0;
  const double base_quarters = left ? (steep ? 2.0 + quarters : 4.0 - quarters) : (steep ? 2.0 - quarters : quarters);
  const double turn = steep != left ? -1.0 : 1.0;
  const double base = base_quarters * 0.25 * kHalfTurn;
  const double base_low = base_quarters * 0.25 * kHalfTurnLow;
  const double sum = base + turn * q;
  return with_sign(sum + (((base - sum) + turn * q) + (base_low + turn * more)));
}

}  // namespace tetap::base
