// SPDX-License-Identifier: Apache-2.0
// sin, cos, atan2 and the wrap of an angle in float, from + - * / and integers in one fixed order: the same bits on
// every target. Reduction: Cody & Waite (Software Manual for the Elementary Functions, 1980, ch. 8) up to 4096 rad,
// Payne & Hanek (ACM SIGNUM Newsletter 18(1), 1983) beyond, so every finite float is reduced. Coefficients: minimax,
// rounded to float by lattice reduction (Brisebarre & Chevillard, ARITH 2007). Largest errors, in units of the last
// place of the true value: see test/base/math_test.cpp.
#pragma once

#include "tetap/base/float_bits.hpp"

namespace tetap::base {

struct SinCos {
  float sin, cos;
};

namespace detail {

/// |x| = quadrant * pi/2 + hi + lo with |hi| <= pi/4 (and a little), lo below the last place of hi.
struct Reduced {
  float hi, lo;
  std::uint32_t quadrant;  ///< modulo 4; higher bits are noise
};

inline constexpr std::uint32_t kCodyWaiteLimit = bits(4096.0F);

/// |x| <= 4096. pi/2 is cut so that n times each of the first three parts is exact for n < 2^12, and so are the
/// differences.
[[nodiscard]] constexpr Reduced reduce_near(float x) {
  constexpr float kRound = 0x1.8p+23F;  // adding it leaves the nearest integer in the low bits of the sum
  const float shifted = x * 0x1.45f306p-1F + kRound;
  const float n = shifted - kRound;
  const float r = (x - n * 0x1.92p+0F) - n * 0x1.fb6p-12F;
  const float w = n * -0x1.778p-25F;
  const float hi = r - w;
  return {hi, ((r - hi) - w) - n * 0x1.68c234p-39F, bits(shifted)};
}

/// 2/pi in units of 2^-224, after a word of zeros.
inline constexpr std::uint32_t kTwoOverPi[8] = {0x0000'0000U, 0xa2f9'836eU, 0x4e44'1529U, 0xfc27'57d1U,
                                                0xf534'ddc0U, 0xdb62'9599U, 0x3c43'9041U, 0xfe51'63abU};

/// Finite |x| of at least 2. Bits of 2/pi that would give whole turns are left out; 64 bits of the product decide.
[[nodiscard, gnu::noinline]] constexpr Reduced reduce_far(float x) {
  const std::uint32_t u = bits(x);
  const std::uint64_t m = (u & 0x007f'ffffU) | 0x0080'0000U;
  const std::uint32_t position = (u >> 23) - 120;  // of the first bit that matters
  const std::uint32_t* const word = &kTwoOverPi[position / 32];
  const std::uint32_t shift = position % 32;
  const auto window = [word, shift](int i) { return (word[i] << shift) | (word[i + 1] >> 1 >> (31 - shift)); };
  const std::uint64_t turns =
      ((m * window(0)) << 32) + m * window(1) + ((m * window(2)) >> 32);  // 2^64 is a whole turn
  const std::uint64_t quadrant = (turns + (std::uint64_t{1} << 61)) >> 62;
  std::uint64_t fraction = turns - (quadrant << 62);  // of a quadrant, in units of 2^-62, signed
  const std::uint32_t sign = static_cast<std::uint32_t>(fraction >> 32) & kSignBit;
  if (sign != 0) fraction = 0 - fraction;
  const int zeros =
      std::countl_zero(fraction);  // no float is within 2^-32 of a multiple of pi/2, so 30 and more bits remain
  const std::uint64_t angle = ((fraction << zeros) >> 32) * 0xc90f'daa2U;  // pi/2 in units of 2^-31
  const float scale = from_bits((static_cast<std::uint32_t>(127 + 9 - zeros - 30) << 23) | sign);
  const float head = static_cast<float>(static_cast<std::int32_t>(angle >> 40)) * scale;
  const float tail = static_cast<float>(static_cast<std::int32_t>((angle >> 16) & 0xff'ffffU)) * (scale * 0x1p-24F);
  const float hi = head + tail;
  return {hi, (head - hi) + tail, static_cast<std::uint32_t>(quadrant)};
}

[[nodiscard]] constexpr Reduced reduce(std::uint32_t magnitude) {
  return magnitude <= kCodyWaiteLimit ? reduce_near(from_bits(magnitude)) : reduce_far(from_bits(magnitude));
}

[[nodiscard]] constexpr float sin_kernel(const Reduced& r) {
  const float z = r.hi * r.hi;
  return r.hi + (r.hi * z * (-0x1.555546p-3F + z * (0x1.110774p-7F + z * -0x1.9951dcp-13F)) + r.lo);
}

[[nodiscard]] constexpr float cos_kernel(const Reduced& r) {
  const float z = r.hi * r.hi;
  const float half = 0.5F * z;
  const float head = 1.0F - half;
  const float series = z * z * (0x1.555554p-5F + z * (-0x1.6c129ap-10F + z * 0x1.9bc4fep-16F));
  return head + (((1.0F - head) - half) + (series - r.hi * r.lo));
}

}  // namespace detail

/// Both at once, for little more than one. Within 1.5 ulp for every finite x; kNan for NaN and infinity; sin(-0) = -0.
[[nodiscard]] constexpr SinCos sincos(float x) {
  const std::uint32_t magnitude = bits(x) & ~kSignBit;
  if (magnitude >= kInfinityBits) return {kNan, kNan};
  const detail::Reduced r = detail::reduce(magnitude);
  const std::uint32_t s = bits(detail::sin_kernel(r));
  const std::uint32_t c = bits(detail::cos_kernel(r));
  const bool odd = (r.quadrant & 1U) != 0;
  const std::uint32_t sin_sign = ((r.quadrant << 30) ^ bits(x)) & kSignBit;
  const std::uint32_t cos_sign = ((r.quadrant + 1U) << 30) & kSignBit;
  return {from_bits((odd ? c : s) ^ sin_sign), from_bits((odd ? s : c) ^ cos_sign)};
}

/// The same bits as sincos(x).sin.
[[nodiscard]] constexpr float sin(float x) {
  const std::uint32_t magnitude = bits(x) & ~kSignBit;
  if (magnitude >= kInfinityBits) return kNan;
  const detail::Reduced r = detail::reduce(magnitude);
  const float value = (r.quadrant & 1U) != 0 ? detail::cos_kernel(r) : detail::sin_kernel(r);
  return from_bits(bits(value) ^ (((r.quadrant << 30) ^ bits(x)) & kSignBit));
}

/// The same bits as sincos(x).cos.
[[nodiscard]] constexpr float cos(float x) {
  const std::uint32_t magnitude = bits(x) & ~kSignBit;
  if (magnitude >= kInfinityBits) return kNan;
  const detail::Reduced r = detail::reduce(magnitude);
  const float value = (r.quadrant & 1U) != 0 ? detail::sin_kernel(r) : detail::cos_kernel(r);
  return from_bits(bits(value) ^ (((r.quadrant + 1U) << 30) & kSignBit));
}

/// x less whole turns, in (-kPi, kPi]. Inside, x comes back as it is. Outside, the result is the nearest float to the
/// true remainder, or its neighbour. Its error is below 0.2 urad, whatever |x|. -kPi becomes kPi. kNan for NaN and
/// infinity.
[[nodiscard]] constexpr float wrap_angle(float x) {
  const std::uint32_t magnitude = bits(x) & ~kSignBit;
  if (magnitude < bits(kPi)) return x;
  if (magnitude == bits(kPi)) return kPi;
  if (magnitude >= kInfinityBits) return kNan;
  const detail::Reduced r = detail::reduce(magnitude);
  float base = 0.0F;
  float base_low = 0.0F;
  if ((r.quadrant & 1U) != 0) base = kHalfPi, base_low = kHalfPiLow;
  if ((r.quadrant & 3U) == 2U) base = kPi, base_low = kPiLow;
  // Down from a full turn in quadrant 3, and in quadrant 2 beyond half a turn.
  const bool down = (r.quadrant & 3U) == 3U || ((r.quadrant & 3U) == 2U && (bits(r.hi) & kSignBit) == 0);
  const float wrapped = down ? -base + (r.hi + (r.lo - base_low)) : base + (r.hi + (r.lo + base_low));
  const std::uint32_t result = bits(wrapped) ^ (bits(x) & kSignBit);
  return result == bits(-kPi) ? kPi : from_bits(result);
}

}  // namespace tetap::base
