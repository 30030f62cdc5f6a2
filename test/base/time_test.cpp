// SPDX-License-Identifier: Apache-2.0
// Time as data: stamps of few bits become absolute around a reference; spans become seconds and saturate.
#include "tetap/base/time.hpp"

#include "support/samples.hpp"

#include <cmath>
#include <cstdint>
#include <limits>

#include <gtest/gtest.h>

namespace tetap::base {
namespace {

constexpr std::int64_t kReferences_us[] = {0,
                                           1,
                                           -1,
                                           524'287,
                                           524'288,
                                           1'048'575,
                                           1'048'576,
                                           -1'048'577,
                                           4'294'967'295,
                                           4'294'967'296,
                                           1'700'000'000'000'000,
                                           -1'700'000'000'000'000};

std::uint32_t low_bits(std::int64_t us, int count) {
  return static_cast<std::uint32_t>(static_cast<std::uint64_t>(us) & ((std::uint64_t{1} << count) - 1));
}

static_assert(extend(5, 20, Micros{1'048'576}).us == 1'048'581 &&
              extend(0xFFFFF, 20, Micros{1'048'576}).us == 1'048'575);

TEST(Extend, FindsEveryTimeLessThanHalfAWrapAwayAgain) {
  for (const int count : {8, 16, 20, 24, 32}) {
    const std::int64_t half = std::int64_t{1} << (count - 1);
    for (const std::int64_t reference : kReferences_us) {
      const auto check = [&](std::int64_t offset) {
        ASSERT_EQ(extend(low_bits(reference + offset, count), count, Micros{reference}).us, reference + offset)
            << count << " bits around " << reference << ", " << offset;
      };
      for (const std::int64_t offset : {-half, -half + 1, std::int64_t{-1}, std::int64_t{0}, std::int64_t{1}, half - 1})
        check(offset);
      for (std::uint64_t i = 0; i < 2000; ++i)
        check(static_cast<std::int64_t>(test::mixed(i) % static_cast<std::uint64_t>(2 * half)) - half);
    }
  }
}

TEST(Extend, KeepsTheLowBitsAndStaysWithinHalfAWrapWhateverComes) {
  constexpr std::int64_t kHalf = 1 << 19;
  for (std::uint64_t i = 0; i < 100'000; ++i) {
    const auto low = static_cast<std::uint32_t>(test::mixed(i) & 0xFFFFFU);
    const auto reference = static_cast<std::int64_t>(test::mixed(~i)) / 4;
    const std::int64_t found = extend(low, 20, Micros{reference}).us;
    ASSERT_EQ(low_bits(found, 20), low);
    ASSERT_TRUE(found - reference >= -kHalf && found - reference < kHalf) << found << " " << reference;
  }
}

TEST(Extend, DoesNotSeeBitsAboveTheStamp) {
  EXPECT_EQ(extend(0xABC0'0005U, 20, Micros{0}), extend(0x5U, 20, Micros{0}));
}

TEST(Seconds, AreWithinTwoPlacesOfTheTruthAndOdd) {
  for (std::uint64_t i = 0; i < 200'000; ++i) {
    const auto us = static_cast<std::int64_t>(test::mixed(i) % 2'147'000'001U) >> (i % 31);
    const double truth = static_cast<double>(us) * 1e-6;
    ASSERT_NEAR(static_cast<double>(seconds(Micros{us})), truth, truth * 0x1p-22) << us;
    ASSERT_EQ(seconds(Micros{-us}), -seconds(Micros{us})) << us;
  }
  EXPECT_EQ(seconds(Micros{0}), 0.0F);
  EXPECT_FLOAT_EQ(seconds(Micros{10'000}), 0.01F);
}

TEST(Seconds, SaturateAt2147InsteadOfWrapping) {
  const float limit = seconds(Micros{2'147'000'000});
  EXPECT_FLOAT_EQ(limit, 2147.0F);
  for (const std::int64_t us : {std::int64_t{2'147'000'001}, std::int64_t{2'147'483'648}, std::int64_t{4'294'967'296},
                                std::int64_t{4'294'967'297}, std::numeric_limits<std::int64_t>::max()}) {
    EXPECT_EQ(seconds(Micros{us}), limit) << us;
    EXPECT_EQ(seconds(Micros{-us}), -limit) << us;
  }
  EXPECT_EQ(seconds(Micros{std::numeric_limits<std::int64_t>::min()}), -limit);
  EXPECT_LT(seconds(Micros{2'146'000'000}), limit);
}

TEST(Micros, AddSubtractAndCompareAsIntegers) {
  Micros t{1'700'000'000'000'001};
  t += Micros{-2};
  EXPECT_EQ(t, Micros{1'699'999'999'999'999});
  EXPECT_EQ((t - Micros{1}) + Micros{1}, t);
  EXPECT_LT(Micros{-1}, Micros{0});
  EXPECT_GT(t, t - Micros{1});
}

}  // namespace
}  // namespace tetap::base
