// SPDX-License-Identifier: Apache-2.0
// The functions of base/math.hpp against the C library in double. Samples are dense over all encodings and where a
// method changes. math_exhaustive does the same for every float. Limits and measure (support/ulp.hpp) are the same.
#include "tetap/base/math.hpp"

#include "support/samples.hpp"
#include "support/ulp.hpp"

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

namespace tetap::base {
namespace {

using test::ulp_error;

// The promise is 1.5 ulp, for atan2 1.6. The bounds are math_exhaustive's errors over every float, rounded up, so that
// accuracy is not lost unnoticed. sin 0.9163, cos 0.9118, exp 0.9886, log 0.8399, wrap_angle 0.7517; atan2 1.3663 on
// 10^9 pairs.
constexpr double kSinLimit_ulp = 0.92, kExpLimit_ulp = 0.99, kLogLimit_ulp = 0.84, kWrapLimit_ulp = 0.76,
                 kAtan2Limit_ulp = 1.40;
constexpr double kPiDouble = 0x1.921fb54442d18p+1;
constexpr float kSmallest = 0x1p-149F, kSmallestNormal = 0x1p-126F, kLargest = 0x1.fffffep+127F;

double wide(float x) { return static_cast<double>(x); }
float negated(float x) { return from_bits(bits(x) ^ kSignBit); }

/// Every `stride`-th encoding of [first, end), both signs.
template <class F>
void for_encodings(std::uint32_t first, std::uint32_t end, std::uint32_t stride, F&& f) {
  for (std::uint64_t u = first; u < end; u += stride) {
    f(from_bits(static_cast<std::uint32_t>(u)));
    f(from_bits(static_cast<std::uint32_t>(u) | kSignBit));
  }
}

/// The floats up to `places` places on either side of x, both signs.
template <class F>
void for_neighbours(float x, std::uint32_t places, F&& f) {
  const std::uint32_t middle = bits(x) & ~kSignBit;
  for_encodings(middle < places ? 0 : middle - places, middle + places + 1, 1, f);
}

// A prime stride, so that the low bits of the encodings do not repeat.
constexpr std::uint32_t kStride = 211;
constexpr std::uint32_t kNearEnd = bits(4096.0F) + 1;

// At compile time the same code runs, but for sqrt, which has no instruction then.
static_assert(bits(sin(0.0F)) == 0 && bits(sin(-0.0F)) == kSignBit && bits(cos(0.0F)) == bits(1.0F));
static_assert(bits(exp(0.0F)) == bits(1.0F) && bits(log(1.0F)) == 0 && bits(atan2(0.0F, 1.0F)) == 0);
static_assert(bits(sqrt(2.0F)) == bits(0x1.6a09e6p+0F) && bits(wrap_angle(-kPi)) == bits(kPi));
static_assert(bits(sin(kNan)) == 0x7fc0'0000U && bits(log(-1.0F)) == 0x7fc0'0000U && bits(sqrt(-1.0F)) == 0x7fc0'0000U);

TEST(SinCos, AreWithinOneAndAHalfUlpUpTo4096AndBeyond) {
  test::Worst<float> sine, cosine;
  const auto check = [&](float x) {
    sine.add(ulp_error(sin(x), std::sin(wide(x))), x);
    cosine.add(ulp_error(cos(x), std::cos(wide(x))), x);
  };
  for_encodings(0, kNearEnd, kStride, check);
  for_neighbours(4096.0F, 2000, check);
  EXPECT_LE(sine.ulp, kSinLimit_ulp) << sine.where;
  EXPECT_LE(cosine.ulp, kSinLimit_ulp) << cosine.where;
  for_encodings(kNearEnd, kInfinityBits, kStride, check);
  EXPECT_LE(sine.ulp, kSinLimit_ulp) << sine.where;
  EXPECT_LE(cosine.ulp, kSinLimit_ulp) << cosine.where;
  RecordProperty("sin_ulp", std::to_string(sine.ulp));
  RecordProperty("cos_ulp", std::to_string(cosine.ulp));
}

TEST(SinCos, AreWithinOneAndAHalfUlpBesideEveryMultipleOfAnEighthTurn) {
  // There a result is near zero and the reduction shows, or the quadrant changes.
  test::Worst<float> worst;
  for (int n = 1; n <= 5300; ++n) {
    for_neighbours(static_cast<float>(n * (kPiDouble / 4.0)), 3, [&](float x) {
      worst.add(ulp_error(sin(x), std::sin(wide(x))), x);
      worst.add(ulp_error(cos(x), std::cos(wide(x))), x);
    });
  }
  // The floats nearest to a multiple of pi/2: 1.0e-9 to 5e-9 of a quarter turn. A search over every fraction under
  // every exponent found them.
  for (const float x : {0x1.f37c8ap+95F, 0x1.47d0fep+34F, 0x1.f37c8ap+96F, 0x1.47d0fep+35F, 0x1.f9cbe2p+7F,
                        0x1.f37c8ap+97F, 0x1.32ede2p+85F, 0x1.628d4cp+40F, 0x1.130930p+76F, 0x1.47d0fep+36F}) {
    worst.add(ulp_error(sin(x), std::sin(wide(x))), x);
    worst.add(ulp_error(cos(x), std::cos(wide(x))), x);
  }
  EXPECT_LE(worst.ulp, kSinLimit_ulp) << worst.where;
}

TEST(SinCos, NeverLeaveMinusOneToOneHoweverLargeTheAngle) {
  const auto check = [](float x) {
    const SinCos both = sincos(x);
    ASSERT_TRUE(both.sin >= -1.0F && both.sin <= 1.0F && both.cos >= -1.0F && both.cos <= 1.0F) << x;
    ASSERT_NEAR(wide(both.sin) * wide(both.sin) + wide(both.cos) * wide(both.cos), 1.0, 0x1p-22) << x;
  };
  for_encodings(0, kInfinityBits, 2003, check);
  for_neighbours(kLargest, 0, check);
}

TEST(SinCos, TogetherAreTheSameBitsAsEachAlone) {
  for_encodings(0, kInfinityBits + 2, 1009, [](float x) {
    const SinCos both = sincos(x);
    ASSERT_EQ(bits(both.sin), bits(sin(x))) << x;
    ASSERT_EQ(bits(both.cos), bits(cos(x))) << x;
  });
}

TEST(SinCos, SineIsOddAndCosineEvenToTheBit) {
  for_encodings(0, kInfinityBits, 1009, [](float x) {
    ASSERT_EQ(bits(sin(negated(x))), bits(sin(x)) ^ kSignBit) << x;
    ASSERT_EQ(bits(cos(negated(x))), bits(cos(x))) << x;
  });
}

TEST(Exp, IsWithinOneAndAHalfUlpIntoTheSubnormalsAndUpToTheLargest) {
  test::Worst<float> worst;
  const auto check = [&](float x) { worst.add(ulp_error(exp(x), std::exp(wide(x))), x); };
  for_encodings(0, kInfinityBits + 1, kStride, check);
  for_encodings(bits(0x1p-14F), bits(104.5F), 29, check);  // where the result is neither 1 nor out of range
  for (const float x : {87.0F, 88.72284F, 87.33655F, 103.27893F, 103.97208F})
    for_neighbours(x, 5000, check);  // method and range end
  for (int n = 1; n <= 300; ++n)
    for_neighbours(static_cast<float>(n * 0.34657359027997264), 20, check);  // odd n: reduction's edges
  EXPECT_LE(worst.ulp, kExpLimit_ulp) << worst.where;
  RecordProperty("exp_ulp", std::to_string(worst.ulp));
}

TEST(Exp, IsOneAtZeroAndHasTheLimitsOfIsoC) {
  EXPECT_EQ(bits(exp(0.0F)), bits(1.0F));
  EXPECT_EQ(bits(exp(-0.0F)), bits(1.0F));
  EXPECT_EQ(bits(exp(kInfinity)), kInfinityBits);
  EXPECT_EQ(bits(exp(-kInfinity)), 0U);
  EXPECT_EQ(bits(exp(kLargest)), kInfinityBits);
  EXPECT_EQ(bits(exp(-kLargest)), 0U);
  EXPECT_TRUE(is_finite(exp(88.72283F)));
  EXPECT_EQ(bits(exp(88.72284F)), kInfinityBits);
  EXPECT_EQ(bits(exp(-103.97F)), 1U);
  EXPECT_EQ(bits(exp(-103.9721F)), 0U);
}

TEST(Exp, NeverFallsByMoreThanThePlacesItMayBeWrong) {
  float before = 0.0F;
  for (std::uint32_t u = bits(0x1p-6F); u < bits(88.0F); u += 17) {
    const float y = exp(from_bits(u));
    ASSERT_GE(static_cast<std::int64_t>(bits(y)), static_cast<std::int64_t>(bits(before)) - 2) << from_bits(u);
    before = y;
  }
}

TEST(Log, IsWithinOneAndAHalfUlpSubnormalsIncluded) {
  test::Worst<float> worst;
  const auto check = [&](float x) { worst.add(ulp_error(log(x), std::log(wide(x))), x); };
  for_encodings(0, kInfinityBits + 1, kStride, check);
  for_encodings(bits(0.5F), bits(2.0F), 5, check);  // near 1, where the result is small
  for_neighbours(1.0F, 20000, check);
  for_encodings(0, 20000, 1, check);
  for_neighbours(kSmallestNormal, 5000, check);
  for_neighbours(kLargest, 1, check);
  for (int k = -126; k <= 127; ++k)
    for_neighbours(std::ldexp(0x1.6a09e6p-1F, k), 50, check);  // where the exponent is split off
  EXPECT_LE(worst.ulp, kLogLimit_ulp) << worst.where;
  RecordProperty("log_ulp", std::to_string(worst.ulp));
}

TEST(Log, HasThePolesAndLimitsOfIsoC) {
  EXPECT_EQ(bits(log(1.0F)), 0U);
  EXPECT_EQ(bits(log(0.0F)), bits(-kInfinity));
  EXPECT_EQ(bits(log(-0.0F)), bits(-kInfinity));
  EXPECT_EQ(bits(log(kInfinity)), kInfinityBits);
  for (const float x : {-kSmallest, -kSmallestNormal, -1.0F, -kLargest, -kInfinity})
    EXPECT_EQ(bits(log(x)), bits(kNan)) << x;
}

TEST(Log, OfExpGivesBackWhatWentInToTheErrorOfBoth) {
  for_encodings(bits(0.01F), bits(87.0F), 4001, [](float x) {
    // exp is wrong by 1.5 places of 2^-23 of itself at most, which log turns into an absolute error.
    ASSERT_NEAR(wide(log(exp(x))), wide(x), 1.5 * 0x1p-23 + 1.5 * 0x1p-23 * std::abs(wide(x))) << x;
  });
}

TEST(Atan2, IsWithinItsLimitOnPairsOfTenKinds) {
  constexpr std::uint64_t kPairs = 8'000'000;
  std::array<test::Worst<std::uint64_t>, 10> worst;
  std::uint64_t subnormal_results = 0;
  for (std::uint64_t i = 0; i < kPairs; ++i) {
    const test::Pair p = test::atan2_pair(i);
    const float angle = atan2(p.y, p.x);
    worst[i % 10].add(ulp_error(angle, std::atan2(wide(p.y), wide(p.x))), i);
    const std::uint32_t size = bits(angle) & ~kSignBit;
    subnormal_results += size != 0 && size < 0x0080'0000U ? 1 : 0;
  }
  for (const auto& kind : worst) {
    const test::Pair p = test::atan2_pair(kind.where);
    EXPECT_LE(kind.ulp, kAtan2Limit_ulp) << "kind " << kind.where % 10 << ": atan2(" << p.y << ", " << p.x << ")";
  }
  EXPECT_GT(subnormal_results, kPairs / 50) << "the sample has lost its subnormal results";
}

/// Zeros, infinities, the ends of the subnormals and normals, and some ordinary numbers, of both signs.
std::vector<float> corners() {
  std::vector<float> all;
  for (const float x : {0.0F, kSmallest, 0x1.fffffcp-127F, kSmallestNormal, 0x1p-100F, 0x1p-64F, 0x1p-13F, 0x1p-12F,
                        0.5F, 1.0F, 0x1.000002p+0F, 1.5F, 3.0F, 4096.0F, 0x1p+64F, 0x1p+100F, kLargest, kInfinity}) {
    all.push_back(x);
    all.push_back(negated(x));
  }
  return all;
}

TEST(Atan2, IsWithinItsLimitOnEveryPairOfCorners) {
  for (const float y : corners())
    for (const float x : corners())
      EXPECT_LE(ulp_error(atan2(y, x), std::atan2(wide(y), wide(x))), kAtan2Limit_ulp) << y << " " << x;
}

TEST(Atan2, IsTheNearestFloatInEveryCaseThatIsoCAnnexFNames) {
  const auto named = [](float x) { return bits(x) << 1 == 0 || !is_finite(x); };
  int seen = 0;
  for (const float y : corners()) {
    for (const float x : corners()) {
      if (!named(y) && !named(x)) continue;
      EXPECT_EQ(bits(atan2(y, x)), bits(static_cast<float>(std::atan2(wide(y), wide(x))))) << y << " " << x;
      ++seen;
    }
  }
  EXPECT_EQ(seen, 36 * 36 - 32 * 32);
}

TEST(Atan2, HasTheSymmetriesOfThePlaneToTheBitOrItsError) {
  for (std::uint64_t i = 0; i < 500'000; ++i) {
    const test::Pair p = test::atan2_pair(i);
    if (!is_finite(p.y) || !is_finite(p.x)) continue;
    const float angle = atan2(p.y, p.x);
    ASSERT_EQ(bits(atan2(negated(p.y), p.x)), bits(angle) ^ kSignBit) << p.y << " " << p.x;
    const double mirrored = std::copysign(kPiDouble - std::abs(wide(angle)), wide(p.y));
    ASSERT_NEAR(wide(atan2(p.y, negated(p.x))), mirrored, 0x1p-20) << p.y << " " << p.x;
    ASSERT_LE(std::abs(angle), kPi);
    if ((bits(p.x) & kSignBit) == 0) {
      ASSERT_LE(std::abs(angle), kHalfPi) << p.y << " " << p.x;
    } else {
      ASSERT_GE(std::abs(angle), kHalfPi) << p.y << " " << p.x;
    }
  }
}

TEST(Atan2, DoesNotSeeAPowerOfTwoOnBoth) {
  for (std::uint64_t i = 0; i < 500'000; ++i) {
    const auto word = test::mixed(i);
    const float y = static_cast<float>(test::fraction_of(word) - 0.5),
                x = static_cast<float>(test::fraction_of(test::mixed(~i)) - 0.5);
    if (std::abs(y) < 0x1p-20F || std::abs(x) < 0x1p-20F) continue;
    const float scale = std::ldexp(1.0F, static_cast<int>(word % 224U) - 100);
    ASSERT_EQ(bits(atan2(scale * y, scale * x)), bits(atan2(y, x))) << y << " " << x << " " << scale;
  }
}

TEST(Nan, GoesInAsAnythingAndComesOutAsOnePattern) {
  for (const float nan : test::kNans) {
    for (const float y : {sin(nan), cos(nan), sincos(nan).sin, sincos(nan).cos, exp(nan), log(nan), sqrt(nan),
                          wrap_angle(nan), abs(nan), canonical_nan(nan)})
      EXPECT_EQ(bits(y), 0x7fc0'0000U) << std::hex << bits(nan);
    for (const float x : corners())
      for (const float y : {atan2(nan, x), atan2(x, nan), min(nan, x), min(x, nan), max(nan, x), max(x, nan),
                            clamp(nan, x, 1.0F), clamp(x, nan, 1.0F), clamp(x, 0.0F, nan)})
        EXPECT_EQ(bits(y), 0x7fc0'0000U) << std::hex << bits(nan) << " " << x;
    for (const float other : test::kNans) EXPECT_EQ(bits(atan2(nan, other)), 0x7fc0'0000U);
  }
}

TEST(Nan, IsTheSamePatternWhereAFunctionIsNotDefined) {
  for (const float infinity : {kInfinity, -kInfinity})
    for (const float y :
         {sin(infinity), cos(infinity), sincos(infinity).sin, sincos(infinity).cos, wrap_angle(infinity),
          log(-kInfinity), sqrt(-kInfinity), log(-1.0F), sqrt(-1.0F), sqrt(-kSmallest)})
      EXPECT_EQ(bits(y), 0x7fc0'0000U);
}

TEST(WrapAngle, IsInMinusPiToPiAndThereAlready) {
  for_encodings(0, kInfinityBits, 997, [](float x) {
    const float y = wrap_angle(x);
    ASSERT_TRUE(y > -kPi && y <= kPi) << x;
    ASSERT_EQ(bits(wrap_angle(y)), bits(y)) << x;
    if (x > -kPi && x <= kPi) {
      ASSERT_EQ(bits(y), bits(x)) << x;
    }
  });
  EXPECT_EQ(bits(wrap_angle(-kPi)), bits(kPi));
  EXPECT_EQ(bits(wrap_angle(kPi)), bits(kPi));
  // The floats nearest to half a turn of all (3e-9 to 2e-8 rad beyond, then before): both kPi and -kPi would be the
  // nearest float.
  for (const float x : {0x1.f37c8ap+96F, 0x1.47d0fep+35F, 0x1.f9cbe2p+8F, 0x1.628d4cp+41F, 0x1.b08c4ap+112F}) {
    EXPECT_EQ(bits(wrap_angle(x)), bits(kPi)) << x;
    EXPECT_EQ(bits(wrap_angle(-x)), bits(kPi)) << -x;
  }
}

TEST(WrapAngle, TakesWholeTurnsAwayAndNothingElse) {
  test::Worst<float> worst;
  const auto check = [&worst](float x) {
    if (std::abs(x) <= kPi) return;
    const float y = wrap_angle(x);
    double truth = std::atan2(std::sin(wide(x)), std::cos(wide(x)));
    // Half a turn is the same whichever way round.
    if (std::abs(wide(y) - truth) > kPiDouble) truth = std::copysign(2.0 * kPiDouble - std::abs(truth), wide(y));
    worst.add(ulp_error(y, truth), x);
    ASSERT_NEAR(wide(y), truth, 0.2e-6) << x;
  };
  for_encodings(bits(kPi), kInfinityBits, kStride, check);
  for (int n = 1; n <= 5300; ++n) for_neighbours(static_cast<float>(n * (kPiDouble / 4.0)), 3, check);
  for_neighbours(4096.0F, 100, check);
  EXPECT_LE(worst.ulp, kWrapLimit_ulp) << worst.where;  // so the nearest float or its neighbour
}

TEST(WrapAngle, IsOddButForHalfATurn) {
  for_encodings(0, kInfinityBits, 997, [](float x) {
    const float y = wrap_angle(x);
    ASSERT_EQ(bits(wrap_angle(negated(x))), bits(y) == bits(kPi) ? bits(y) : bits(y) ^ kSignBit) << x;
  });
}

TEST(Sqrt, IsTheHardwaresRootAndTheOneOfConstantExpressionsIsTheSame) {
  const auto check = [](float x) {
    const float truth =
        static_cast<float>(std::sqrt(wide(x)));  // the root in double rounds to float like the exact one
    ASSERT_EQ(bits(sqrt(x)), bits(x) > kSignBit ? bits(kNan) : bits(truth)) << x;
    if (bits(x) > 0 && bits(x) < kInfinityBits) {
      ASSERT_EQ(bits(detail::sqrt_by_integers(bits(x))), bits(truth)) << x;
    }
  };
  for_encodings(0, kInfinityBits + 1, 499, check);
  for_encodings(0, 5000, 1, check);
  for_neighbours(kSmallestNormal, 5000, check);
  for_neighbours(1.0F, 50000, check);
  for_neighbours(kLargest, 1, check);
  EXPECT_EQ(bits(sqrt(-0.0F)), kSignBit);
  EXPECT_EQ(bits(sqrt(kInfinity)), kInfinityBits);
}

constexpr std::array kArguments{
    0.0F,  -0.0F,  0x1p-149F, 1e-5F,   -0.3F,   0.7853982F, 1.0F,   -1.5707964F, 2.0F,      3.1415927F, -6.2831855F,
    30.0F, -87.5F, 88.5F,     -100.0F, 4095.9F, 4096.5F,    -1e10F, 3e38F,       kInfinity, -kInfinity, kNan};
using Arguments = std::array<float, kArguments.size()>;

/// Every function over all arguments, and atan2 over all pairs of them.
constexpr auto table_of(const Arguments& arguments) {
  std::array<std::uint32_t, kArguments.size() * (kArguments.size() + 8)> table{};
  std::size_t i = 0;
  for (const float x : arguments) {
    for (const float y : {sin(x), cos(x), sincos(x).sin, sincos(x).cos, exp(x), log(x), sqrt(x), wrap_angle(x)})
      table[i++] = bits(y);
    for (const float other : arguments) table[i++] = bits(atan2(x, other));
  }
  return table;
}

TEST(Constexpr, GivesTheBitsOfRunTime) {
  static constexpr auto kCompiled = table_of(kArguments);
  Arguments unknown{};
  for (std::size_t i = 0; i < unknown.size(); ++i) {
    const volatile std::uint32_t u = bits(kArguments[i]);  // the compiler must not know it
    unknown[i] = from_bits(u);
  }
  EXPECT_EQ(table_of(unknown), kCompiled);
}

TEST(FloatBits, MinAndMaxOrderTheZerosToo) {
  for (const float a : corners()) {
    for (const float b : corners()) {
      const bool a_first = a < b || (bits(a) == kSignBit && bits(b) == 0);
      EXPECT_EQ(bits(min(a, b)), bits(a_first ? a : b)) << a << " " << b;
      EXPECT_EQ(bits(max(a, b)), bits(a_first ? b : a)) << a << " " << b;
    }
  }
}

TEST(FloatBits, ClampKeepsWhatIsInsideAndTakesHighWhenTheLimitsAreCrossed) {
  for (const float x : corners()) {
    const float y = clamp(x, -2.0F, 3.0F);
    EXPECT_EQ(bits(y), bits(x < -2.0F ? -2.0F : x > 3.0F ? 3.0F : x)) << x;
    EXPECT_EQ(bits(clamp(x, 3.0F, -2.0F)), bits(-2.0F)) << x;
  }
}

TEST(FloatBits, ClassifiesEveryKindLikeTheCLibrary) {
  for_encodings(0, kSignBit, 9973, [](float x) {
    ASSERT_EQ(is_nan(x), std::isnan(x)) << std::hex << bits(x);
    ASSERT_EQ(is_finite(x), std::isfinite(x)) << std::hex << bits(x);
    ASSERT_EQ(bits(abs(x)), is_nan(x) ? bits(kNan) : bits(x) & ~kSignBit);
    ASSERT_EQ(bits(canonical_nan(x)), is_nan(x) ? bits(kNan) : bits(x));
  });
  for (const float x : {kInfinity, -kInfinity}) EXPECT_TRUE(!is_finite(x) && !is_nan(x));
  for (const float x : {kLargest, -kLargest, 0.0F, -0.0F}) EXPECT_TRUE(is_finite(x) && !is_nan(x));
  for (const float nan : test::kNans) EXPECT_TRUE(!is_finite(nan) && is_nan(nan));
}

TEST(FloatBits, PiIsTheNearestFloatAndItsRest) {
  EXPECT_EQ(kPi, static_cast<float>(kPiDouble));
  EXPECT_EQ(kHalfPi, static_cast<float>(kPiDouble / 2.0));
  EXPECT_NEAR(wide(kPi) + wide(kPiLow), kPiDouble, 1e-14);
  EXPECT_NEAR(wide(kHalfPi) + wide(kHalfPiLow), kPiDouble / 2.0, 1e-14);
}

}  // namespace
}  // namespace tetap::base
