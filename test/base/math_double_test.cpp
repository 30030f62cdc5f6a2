// SPDX-License-Identifier: Apache-2.0
// The functions of base/math_double.hpp against the C library in long double, to 2 ulp each (measure: support/ulp.hpp).
#include "tetap/base/math_double.hpp"

#include "support/samples.hpp"
#include "support/ulp.hpp"

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace tetap::base {
namespace {

using test::mixed;
using test::ulp_error;

// The promise is 2 ulp. The bound is the largest error in some 10^7 samples, rounded up, so that accuracy is not lost
// unnoticed. The errors: sin and cos 1.063 (0.78 but beside multiples of pi/2), exp 0.87, log 0.83, atan2 1.47.
constexpr double kSinLimit_ulp = 1.1, kExpLimit_ulp = 0.95, kLogLimit_ulp = 0.9, kAtan2Limit_ulp = 1.5;
constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr double kLargest = std::numeric_limits<double>::max(), kSmallestNormal = std::numeric_limits<double>::min();
constexpr double kSmallest = std::numeric_limits<double>::denorm_min();
constexpr double kReduced = 1048576.0;  // sincos is defined up to here
constexpr std::uint64_t kSign = std::uint64_t{1} << 63, kCanonicalNan = 0x7ff8'0000'0000'0000U;

std::uint64_t raw(double x) { return std::bit_cast<std::uint64_t>(x); }
double from_raw(std::uint64_t u) { return std::bit_cast<double>(u); }
long double wide(double x) { return static_cast<long double>(x); }

/// Noise as a number of either sign with its exponent in [low, high).
double number(std::uint64_t word, int low, int high) {
  const int exponent = low + static_cast<int>((word >> 52 & 0x7ffU) % static_cast<unsigned>(high - low));
  return std::ldexp(from_raw((word & 0x800f'ffff'ffff'ffffU) | raw(1.0)), exponent);
}

/// The doubles up to `places` places on either side of positive x.
template <class F>
void for_neighbours(double x, std::uint64_t places, F&& f) {
  const std::uint64_t first = raw(x) < places ? 0 : raw(x) - places;
  for (std::uint64_t u = first; u <= raw(x) + places; ++u) f(from_raw(u));
}

struct SinCosError {
  test::Worst<double> sine, cosine;
  void operator()(double x) {
    const SinCosDouble both = sincos(x);
    sine.add(ulp_error(both.sin, std::sin(wide(x))), x);
    cosine.add(ulp_error(both.cos, std::cos(wide(x))), x);
  }
};

static_assert(std::bit_cast<std::uint64_t>(sqrt(2.0)) == std::bit_cast<std::uint64_t>(0x1.6a09e667f3bcdp+0));
static_assert(std::bit_cast<std::uint64_t>(sin(0.0)) == 0 &&
              std::bit_cast<std::uint64_t>(exp(0.0)) == std::bit_cast<std::uint64_t>(1.0));
static_assert(std::bit_cast<std::uint64_t>(log(1.0)) == 0 &&
              std::bit_cast<std::uint64_t>(log(-1.0)) == 0x7ff8'0000'0000'0000U);

TEST(SinCosDouble, AreWithinTwoUlpFromTheSmallestToTwoToThe20) {
  SinCosError error;
  for (std::uint64_t i = 0; i < 600'000; ++i) {
    error(number(mixed(i), -60, 20));
    error((2.0 * test::fraction_of(mixed(~i)) - 1.0) * (i % 2 == 0 ? 4.0 : kReduced));
  }
  for (const double x : {kSmallest, kSmallestNormal, 0x1p-300, 0x1p-27, 0x1p-26, kReduced}) error(x), error(-x);
  EXPECT_LE(error.sine.ulp, kSinLimit_ulp) << error.sine.where;
  EXPECT_LE(error.cosine.ulp, kSinLimit_ulp) << error.cosine.where;
  RecordProperty("sin_ulp", std::to_string(error.sine.ulp));
  RecordProperty("cos_ulp", std::to_string(error.cosine.ulp));
}

TEST(SinCosDouble, AreWithinTwoUlpAtTheDoublesNearestToEveryQuarterTurn) {
  // There sine or cosine is as small as it becomes, and the error of the reduction as large.
  SinCosError error;
  constexpr long double kHalfPi = 1.57079632679489661923132169163975144L;
  for (int n = 1; n <= 667'543; ++n) {
    const auto x = static_cast<double>(static_cast<long double>(n) * kHalfPi);
    if (n < 20'000) {
      for_neighbours(x, 2, error);
    } else {
      error(x);
    }
  }
  EXPECT_LE(error.sine.ulp, kSinLimit_ulp) << error.sine.where;
  EXPECT_LE(error.cosine.ulp, kSinLimit_ulp) << error.cosine.where;
}

TEST(SinCosDouble, AreWithinTwoUlpWhereTheQuadrantChanges) {
  SinCosError error;
  for (int n = 1; n < 40'000; n += 2) for_neighbours(n * 0.78539816339744831, 3, error);
  EXPECT_LE(error.sine.ulp, kSinLimit_ulp) << error.sine.where;
  EXPECT_LE(error.cosine.ulp, kSinLimit_ulp) << error.cosine.where;
}

TEST(SinCosDouble, SineIsOddAndCosineEvenToTheBitAndEachAloneTheSame) {
  for (std::uint64_t i = 0; i < 200'000; ++i) {
    const double x = number(mixed(i), -40, 20);
    const SinCosDouble both = sincos(x);
    ASSERT_EQ(raw(sincos(-x).sin), raw(both.sin) ^ kSign) << x;
    ASSERT_EQ(raw(sincos(-x).cos), raw(both.cos)) << x;
    ASSERT_EQ(raw(sin(x)), raw(both.sin)) << x;
    ASSERT_EQ(raw(cos(x)), raw(both.cos)) << x;
  }
  EXPECT_EQ(raw(sin(-0.0)), kSign);
  EXPECT_EQ(raw(cos(-0.0)), raw(1.0));
}

TEST(ExpDouble, IsWithinTwoUlpIntoTheSubnormalsAndUpToTheLargest) {
  test::Worst<double> worst;
  const auto check = [&](double x) { worst.add(ulp_error(exp(x), std::exp(wide(x))), x); };
  for (std::uint64_t i = 0; i < 500'000; ++i) {
    check(number(mixed(i), -60, 10));
    check(-746.0 + test::fraction_of(mixed(~i)) * (746.0 + 710.0));
    check(-708.0 - test::fraction_of(mixed(~i)) * 38.0);  // results that end as subnormals
  }
  for (const double x : {709.782712893384, 708.3964185322641, 745.1332191019411, 745.2, 0.34657359027997264})
    for_neighbours(x, 2000, [&](double y) { check(y), check(-y); });
  for (const double x : {0.0, kSmallest, kLargest, kInf}) check(x), check(-x);
  EXPECT_LE(worst.ulp, kExpLimit_ulp) << worst.where;
  RecordProperty("exp_ulp", std::to_string(worst.ulp));
}

TEST(LogDouble, IsWithinTwoUlpSubnormalsIncluded) {
  test::Worst<double> worst;
  const auto check = [&](double x) { worst.add(ulp_error(log(x), std::log(wide(x))), x); };
  for (std::uint64_t i = 0; i < 500'000; ++i) {
    check(from_raw(mixed(i) & ~kSign));  // NaN and infinity with them
    check(0.5 + 1.5 * test::fraction_of(mixed(~i)));
    check(from_raw(mixed(i) >> (12 + i % 50)));  // subnormals
  }
  for (const double x : {0.0, 1.0, 0.70710678118654752, 1.4142135623730951, kSmallestNormal})
    for_neighbours(x, 2000, check);
  for (const double x : {kLargest, kInf, -0.0, -1.0, -kSmallest, -kInf}) check(x);
  EXPECT_LE(worst.ulp, kLogLimit_ulp) << worst.where;
  RecordProperty("log_ulp", std::to_string(worst.ulp));
}

TEST(Atan2Double, IsWithinTwoUlpOnRandomAndStructuredPairs) {
  std::array<test::Worst<std::pair<double, double>>, 6> worst;
  const auto check = [&](std::size_t kind, double y, double x) {
    worst[kind].add(ulp_error(atan2(y, x), std::atan2(wide(y), wide(x))), {y, x});
  };
  for (std::uint64_t i = 0; i < 250'000; ++i) {
    const std::uint64_t a = mixed(i), b = mixed(~i);
    check(0, from_raw(a), from_raw(b));
    check(1, number(a, -3, 3), number(b, -3, 3));
    check(2, number(a, -30, 0), number(b, 0, 40));
    check(2, number(a, 0, 40), number(b, -30, 0));
    check(3, number(a, -1070, -960), number(b, -40, 64));  // results around the subnormals
    check(4, from_raw((a & kSign) | a >> (13 + i % 40)), from_raw((b & kSign) | b >> (13 + a % 40)));
    check(4, number(a, 1000, 1024), number(b, 1000, 1024));
    const double x = number(a, -100, 100);
    check(5, from_raw((raw(x) + b % 17 - 8) ^ (b & kSign)), x);  // the diagonals
    const double small = std::abs(x) * 0.41421356237309503;      // tan(pi/8), where the method changes
    check(5, from_raw(raw(small) + b % 17 - 8), x);
    check(5, x, from_raw((raw(small) + b % 17 - 8) ^ (b & kSign)));
  }
  // Just above tan(pi/8), where sum and difference of the operands lose most: two pairs that plain rounding gets wrong
  // by more than 2 ulp.
  check(5, 0x1.6c0d997634ba7p-1, 0x1.b61523762544bp+0);
  check(5, 0x1.6a8ed2365c6adp-1, 0x1.b5906167337eap+0);
  for (std::size_t kind = 0; kind < worst.size(); ++kind)
    EXPECT_LE(worst[kind].ulp, kAtan2Limit_ulp)
        << "kind " << kind << ": " << worst[kind].where.first << " " << worst[kind].where.second;
}

std::vector<double> corners() {
  std::vector<double> all;
  for (const double x : {0.0, kSmallest, 0x1.8p-1023, kSmallestNormal, 0x1p-901, 1e-5, 1.0, 1.5, 3.0, 1e8, 0x1.8p+1000,
                         kLargest, kInf}) {
    all.push_back(x);
    all.push_back(-x);
  }
  return all;
}

TEST(Atan2Double, IsWithinTwoUlpOnEveryPairOfCorners) {
  for (const double y : corners())
    for (const double x : corners())
      EXPECT_LE(ulp_error(atan2(y, x), std::atan2(wide(y), wide(x))), kAtan2Limit_ulp) << y << " " << x;
}

TEST(Atan2Double, IsTheNearestDoubleInEveryCaseThatIsoCAnnexFNames) {
  for (const double y : corners())
    for (const double x : corners())
      if (raw(y) << 1 == 0 || raw(x) << 1 == 0 || !std::isfinite(y) || !std::isfinite(x)) {
        EXPECT_EQ(raw(atan2(y, x)), raw(static_cast<double>(std::atan2(wide(y), wide(x))))) << y << " " << x;
      }
}

TEST(SqrtDouble, IsTheHardwaresRootWithAndWithoutADoubleUnit) {
  const auto check = [](double x) {
    const std::uint64_t truth = std::isnan(x) || x < 0.0 ? kCanonicalNan : raw(std::sqrt(x));
    ASSERT_EQ(raw(sqrt(x)), truth) << x;
    ASSERT_EQ(raw(detail::sqrt_by_integers(x)), truth) << x;
  };
  for (std::uint64_t i = 0; i < 500'000; ++i) {
    check(from_raw(mixed(i)));
    check(from_raw(mixed(i) >> (12 + i % 50)));  // subnormals
    const auto root = static_cast<double>(mixed(i) >> 38);
    for_neighbours(root * root, 1, check);  // exact roots and those that lie almost between two
  }
  for (const double x : corners()) check(x);
}

TEST(NanDouble, IsOnePatternWhateverGoesInAndWhereAFunctionIsNotDefined) {
  for (const std::uint64_t u : {std::uint64_t{0x7ff8'0000'0000'0000}, std::uint64_t{0xfff8'0000'0000'0000},
                                std::uint64_t{0x7ff8'0000'0000'0001}, ~std::uint64_t{0}, ~kSign,
                                std::uint64_t{0x7ff0'0000'0000'0001}, std::uint64_t{0xfff0'0000'0000'0001}}) {
    const double nan = from_raw(u);
    for (const double y : {sin(nan), cos(nan), sincos(nan).sin, sincos(nan).cos, exp(nan), log(nan), sqrt(nan),
                           detail::sqrt_by_integers(nan)})
      EXPECT_EQ(raw(y), kCanonicalNan) << std::hex << u;
    for (const double x : corners())
      for (const double y : {atan2(nan, x), atan2(x, nan), atan2(nan, nan)})
        EXPECT_EQ(raw(y), kCanonicalNan) << std::hex << u << " " << x;
  }
  for (const double y : {sin(kInf), cos(-kInf), sin(1048577.0), cos(-1048577.0), log(-1.0), log(-kInf), sqrt(-1.0),
                         sqrt(-kInf), sqrt(-kSmallest)})
    EXPECT_EQ(raw(y), kCanonicalNan);
}

constexpr std::array kArguments{0.0,
                                -0.0,
                                kSmallest,
                                1e-5,
                                -0.3,
                                0.7853981633974483,
                                1.0,
                                -1.5707963267948966,
                                2.0,
                                3.1415926535897931,
                                30.0,
                                -87.5,
                                -740.0,
                                709.5,
                                4095.9,
                                -1e5,
                                1e10,
                                3e300,
                                kInf,
                                -kInf,
                                detail::kNanDouble};
using Arguments = std::array<double, kArguments.size()>;

constexpr auto table_of(const Arguments& arguments) {
  std::array<std::uint64_t, kArguments.size() * (kArguments.size() + 5)> table{};
  std::size_t i = 0;
  for (const double x : arguments) {
    for (const double y : {sin(x), cos(x), exp(x), log(x), sqrt(x)}) table[i++] = std::bit_cast<std::uint64_t>(y);
    for (const double other : arguments) table[i++] = std::bit_cast<std::uint64_t>(atan2(x, other));
  }
  return table;
}

TEST(ConstexprDouble, GivesTheBitsOfRunTime) {
  static constexpr auto kCompiled = table_of(kArguments);
  Arguments unknown{};
  for (std::size_t i = 0; i < unknown.size(); ++i) {
    const volatile std::uint64_t u = raw(kArguments[i]);  // the compiler must not know it
    unknown[i] = from_raw(u);
  }
  EXPECT_EQ(table_of(unknown), kCompiled);
}

}  // namespace
}  // namespace tetap::base
