// SPDX-License-Identifier: Apache-2.0
// atan2 in float, from + - * / in one fixed order: the same bits on every target. The quotient is carried with its
// remainder (Dekker's exact product, Numer. Math. 18, 1971), because a quotient rounded once would alone cost half a
// place. Polynomial: minimax in z = q^2.
#pragma once

#include "tetap/base/float_bits.hpp"

namespace tetap::base {

namespace detail {

/// a * b = value + error, exactly, for products that neither overflow nor lose bits to the subnormals.
struct Exact {
  float value, error;
};
[[nodiscard]] constexpr Exact multiply(float a, float b) {
  constexpr float kSplit = 4097.0F;  // 2^12 + 1
  const float a_wide = kSplit * a;
  const float b_wide = kSplit * b;
  const float a_high = a_wide - (a_wide - a);
  const float b_high = b_wide - (b_wide - b);
  const float a_low = a - a_high;
  const float b_low = b - b_high;
  const float value = a * b;
  return {value, ((a_high * b_high - value) + a_high * b_low + a_low * b_high) + a_low * b_low};
}

/// atan(low / high) as value + tail for 0 <= low <= high, both normal and within 2^20 of 1.
[[nodiscard]] constexpr Exact atan_of_quotient(float low, float high) {
  const float q = low / high;
  const Exact product = multiply(q, high);
  const float rest = ((low - product.value) - product.error) / high;  // what the quotient lacks
  const float z = q * q;
  const float series =
      -0x1.55553ep-2F +
      z * (0x1.9991fep-3F +
           z * (-0x1.2421b6p-3F +
                z * (0x1.c09a00p-4F + z * (-0x1.583496p-4F +
                                           z * (0x1.dac9fap-5F + z * (-0x1.fed196p-6F +
                                                                      z * (0x1.65a69ep-7F + z * -0x1.d63074p-10F)))))));
  const float more = q * z * series + rest / (1.0F + z);
  const float value = q + more;
  return {value, more - (value - q)};
}

/// Zeros, infinities and NaN, by ISO C annex F.10.1.4.
[[nodiscard, gnu::noinline]] constexpr float atan2_special(float y, float x) {
  if (is_nan(x) || is_nan(y)) return kNan;
  const std::uint32_t sign = bits(y) & kSignBit;
  const bool left = (bits(x) & kSignBit) != 0;
  const bool y_infinite = (bits(y) & ~kSignBit) == kInfinityBits;
  const bool x_infinite = (bits(x) & ~kSignBit) == kInfinityBits;
  float angle = left ? kPi : 0.0F;                                                          // y zero, or x infinite
  if (y_infinite) angle = x_infinite ? (left ? 0x1.2d97c8p+1F : 0x1.921fb6p-1F) : kHalfPi;  // 3 pi/4, pi/4, pi/2
  if (!y_infinite && !x_infinite && (bits(y) & ~kSignBit) != 0) angle = kHalfPi;            // x zero
  return from_bits(bits(angle) ^ sign);
}

/// 2^n for -126 <= n <= 127.
[[nodiscard]] constexpr float power_of_two(std::int32_t n) {
  return from_bits(static_cast<std::uint32_t>(n + 127) << 23);
}

}  // namespace detail

/// Angle of the point (x, y) from the x axis, in [-kPi, kPi]. Within 1.6 ulp, subnormal results included; special cases
/// as in ISO C.
[[nodiscard]] constexpr float atan2(float y, float x) {
  const std::uint32_t ay = bits(y) & ~kSignBit;
  const std::uint32_t ax = bits(x) & ~kSignBit;
  if (ax - 1 >= kInfinityBits - 1 || ay - 1 >= kInfinityBits - 1) return detail::atan2_special(y, x);
  const bool steep = ay > ax;
  const bool left = (bits(x) & kSignBit) != 0;
  float high = from_bits(steep ? ay : ax);
  float low = from_bits(steep ? ax : ay);
  // Both brought near 1, so that the exact product neither overflows nor underflows. A subnormal larger one first
  // becomes normal.
  if (bits(high) < 0x0080'0000U) high *= 0x1p+24F, low *= 0x1p+24F;
  const auto exponent = static_cast<std::int32_t>(bits(high) >> 23) - 127;
  const bool tiny = static_cast<std::int32_t>(bits(high) >> 23) - static_cast<std::int32_t>(bits(low) >> 23) > 13;
  const float half_scale = detail::power_of_two(-exponent / 2);
  const float other_scale = detail::power_of_two(-exponent - (-exponent / 2));
  detail::Exact angle{};
  if (tiny) {  // atan(q) is q less q^3/3, below a third of q's last place; the division may end among the subnormals
               // and rounds once
    const float q = low / high;
    if (!steep && !left) return from_bits(bits(q) | (bits(y) & kSignBit));
    angle = {q, 0.0F};
  } else {
    angle = detail::atan_of_quotient(low * half_scale * other_scale, high * half_scale * other_scale);
  }
  if (steep || left) {
    const float base = steep ? kHalfPi : kPi;
    const float base_low = steep ? kHalfPiLow : kPiLow;
    const bool subtract = steep != left;
    const float term = subtract ? -angle.value : angle.value;
    const float tail = subtract ? -angle.error : angle.error;
    const float sum = base + term;
    angle = {sum + (((base - sum) + term) + (base_low + tail)), 0.0F};
  }
  return from_bits(bits(angle.value) | (bits(y) & kSignBit));
}

}  // namespace tetap::base
