// SPDX-License-Identifier: Apache-2.0
// Error of a floating-point result, in units of the last place of the true value: the one measure behind every
// limit in ulp.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

namespace tetap::test {

/// |got - truth| / ulp(truth). One ulp is 2^(e-23) for |truth| in [2^e, 2^(e+1)), and 2^-149 below 2^-126. Infinite, so
/// above any limit: a NaN that is not the canonical one (7fc00000) or not due. Infinite too: another sign than the
/// truth's (of zero too), a finite result for a truth of 2^128 and more. An infinite result for a smaller truth counts
/// as 2^128. The truth comes in double: its own error is 2^-29 ulp.
[[nodiscard]] inline double ulp_error(float got, double truth) {
  constexpr double kNever = std::numeric_limits<double>::infinity();
  constexpr double kBeyond = 0x1p+128;
  const auto g = std::bit_cast<std::uint32_t>(got);
  const auto t = std::bit_cast<std::uint64_t>(truth);
  if (std::isnan(truth)) return g == 0x7fc0'0000U ? 0.0 : kNever;
  if (std::isnan(got) || g >> 31 != t >> 63) return kNever;
  if (std::abs(truth) >= kBeyond) return std::isinf(got) ? 0.0 : kNever;
  const double reached = std::isinf(got) ? kBeyond : std::abs(static_cast<double>(got));
  const std::int64_t e = static_cast<std::int64_t>(t >> 52 & 0x7ffU) - 1023;
  const double per_ulp = std::bit_cast<double>(static_cast<std::uint64_t>(1023 + 23 - (e < -126 ? -126 : e)) << 52);
  return std::abs(reached - std::abs(truth)) * per_ulp;
}

/// The same for double (ulp 2^(e-52), not below 2^-1074; canonical NaN 7ff8000000000000), judged in long double: error
/// of the truth 2^-11 ulp.
[[nodiscard]] inline double ulp_error(double got, long double truth) {
  static_assert(std::numeric_limits<long double>::digits >= 64, "the judge needs at least 11 bits more than double");
  constexpr double kNever = std::numeric_limits<double>::infinity();
  constexpr long double kBeyond = 0x1p+1024L;
  if (std::isnan(truth)) return std::bit_cast<std::uint64_t>(got) == 0x7ff8'0000'0000'0000U ? 0.0 : kNever;
  if (std::isnan(got) || std::signbit(got) != std::signbit(truth)) return kNever;
  const long double magnitude = std::abs(truth);
  if (magnitude >= kBeyond) return std::isinf(got) ? 0.0 : kNever;
  const long double reached = std::isinf(got) ? kBeyond : std::abs(static_cast<long double>(got));
  const int e = magnitude < 0x1p-1022L ? -1022 : std::ilogb(magnitude);
  return static_cast<double>(std::ldexp(std::abs(reached - magnitude), 52 - e));
}

/// The largest error met, and where.
template <class Where>
struct Worst {
  double ulp = 0;
  Where where{};
  std::uint64_t count = 0;

  void add(double error, const Where& at) {
    ++count;
    if (error > ulp) ulp = error, where = at;
  }
};

}  // namespace tetap::test
