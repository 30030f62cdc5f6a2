// SPDX-License-Identifier: Apache-2.0
// IEEE 754 binary64 addition in integers, rounded to nearest even, for cores without a double-precision unit. Some
// differences are rounded to the wrong neighbour by libgcc 12.2 (ieee754-df.S of ARMv7-M). They have operands of
// opposite sign whose exponents are 33 apart. `make bits` met one: its sum is then not the sum of the other targets.
// Every NaN is the one canonical NaN.
#pragma once

#include <bit>
#include <cstdint>

namespace tetap::hal {

[[nodiscard]] constexpr std::uint64_t double_sum(std::uint64_t a, std::uint64_t b) {
  constexpr std::uint64_t kSign = std::uint64_t{1} << 63;
  constexpr std::uint64_t kInfinity = std::uint64_t{0x7FF} << 52;
  constexpr std::uint64_t kNan = kInfinity | std::uint64_t{1} << 51;
  constexpr std::uint64_t kImplicit = std::uint64_t{1} << 52;
  constexpr int kExtra = 3;  // guard, round and sticky
  constexpr std::uint64_t kOne = kImplicit << kExtra;

  if ((a & ~kSign) < (b & ~kSign)) {
    const std::uint64_t swapped = a;
    a = b;
    b = swapped;
  }
  const std::uint64_t large = a & ~kSign;
  const std::uint64_t small = b & ~kSign;
  const bool opposite = ((a ^ b) & kSign) != 0;
  if (large >= kInfinity) return large > kInfinity || (small == kInfinity && opposite) ? kNan : a;
  if (large == small && opposite) return 0;
  if (small == 0) return a;

  // Subnormals have the exponent of the smallest normal and no leading bit.
  int exponent = static_cast<int>(large >> 52);
  const int small_exponent = static_cast<int>(small >> 52);
  std::uint64_t sum = (large & (kImplicit - 1)) << kExtra;
  if (exponent != 0) sum |= kOne;
  std::uint64_t addend = (small & (kImplicit - 1)) << kExtra;
  if (small_exponent != 0) addend |= kOne;
  if (exponent == 0) exponent = 1;
  const int apart = exponent - (small_exponent == 0 ? 1 : small_exponent);
  if (apart > 55) {
    addend = 1;
  } else {
    const std::uint64_t lost = addend & ((std::uint64_t{1} << apart) - 1);
    addend = addend >> apart | (lost != 0 ? 1U : 0U);
  }

  if (!opposite) {
    sum += addend;
    if (sum >= kOne << 1) {
      sum = sum >> 1 | (sum & 1);
      ++exponent;
    }
  } else {
    sum -= addend;
    const int wanted = std::countl_zero(sum) - std::countl_zero(kOne);
    const int shift = wanted < exponent - 1 ? wanted : exponent - 1;
    sum <<= shift;
    exponent -= shift;
  }
  if (exponent >= 0x7FF) return (a & kSign) | kInfinity;

  // The leading bit, where there is one, carries into the exponent; so does a round up to the next power of two.
  std::uint64_t packed = (static_cast<std::uint64_t>(exponent - 1) << 52) + (sum >> kExtra);
  const std::uint64_t rest = sum & ((1U << kExtra) - 1);
  constexpr std::uint64_t kHalf = 1U << (kExtra - 1);
  if (rest > kHalf || (rest == kHalf && (packed & 1) != 0)) ++packed;
  return (a & kSign) | packed;
}

[[nodiscard]] constexpr std::uint64_t double_difference(std::uint64_t a, std::uint64_t b) {
  return double_sum(a, b ^ std::uint64_t{1} << 63);
}

}  // namespace tetap::hal
