// SPDX-License-Identifier: Apache-2.0
// Philox by its published answers; the draws by statistics with two-sided bounds: seeds are fixed, and a result too
// good fails as well. Every bound leaves out 0.1 % in all (0.05 % on either side), so that among some dozens of honest
// figures none is expected outside.
#include "tetap/base/random.hpp"

#include "support/consistency.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <set>
#include <vector>

#include <gtest/gtest.h>

namespace tetap::base {
namespace {

constexpr double kQuantile = 3.2905;  // of the normal distribution, for 99.95 %

/// Is a sum of squares of `degrees` independent standard normal variables one to be expected?
testing::AssertionResult is_chi_square(double sum, double degrees) {
  const double low = test::chi_square_quantile(-kQuantile, degrees),
               high = test::chi_square_quantile(kQuantile, degrees);
  if (sum >= low && sum <= high) return testing::AssertionSuccess();
  return testing::AssertionFailure() << sum << " is not in [" << low << ", " << high << "], chi-square of " << degrees;
}

double squared(double x) { return x * x; }

/// Pearson's sum over bins that are all expected equally full.
double pearson(const std::vector<int>& bins, double draws) {
  const double expected = draws / static_cast<double>(bins.size());
  double sum = 0;
  for (const int bin : bins) sum += squared(bin - expected) / expected;
  return sum;
}

// kat_vectors of the Random123 distribution (D. E. Shaw Research), lines "philox4x32 10".
static_assert(philox({0, 0, 0, 0}, {0, 0}) == PhiloxCounter{0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8});
static_assert(philox({0xffffffff, 0xffffffff, 0xffffffff, 0xffffffff}, {0xffffffff, 0xffffffff}) ==
              PhiloxCounter{0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd});
static_assert(philox({0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344}, {0xa4093822, 0x299f31d0}) ==
              PhiloxCounter{0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1});

TEST(Philox, HasThePublishedAnswersAtRunTimeToo) {
  volatile std::uint32_t ones = 0xffffffff;
  const std::uint32_t u = ones;
  EXPECT_EQ(philox({u, u, u, u}, {u, u}), (PhiloxCounter{0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd}));
}

TEST(Philox, ChangesHalfOfAllBitsWhenOneBitOfCounterOrKeyChanges) {
  double changed = 0;
  int flips = 0;
  for (std::uint32_t i = 0; i < 500; ++i) {
    const PhiloxCounter counter{i, 7 * i, 0, 3};
    const PhiloxKey key{2026, i};
    const PhiloxCounter before = philox(counter, key);
    for (std::size_t bit = 0; bit < 192; ++bit) {
      PhiloxCounter other = counter;
      PhiloxKey other_key = key;
      (bit < 128 ? other[bit / 32] : other_key[bit / 32 - 4]) ^= 1U << (bit % 32);
      const PhiloxCounter after = philox(other, other_key);
      for (std::size_t w = 0; w < 4; ++w) changed += std::popcount(before[w] ^ after[w]);
      ++flips;
    }
  }
  const double bits_seen = 128.0 * flips;
  EXPECT_NEAR(changed / bits_seen, 0.5, kQuantile * 0.5 / std::sqrt(bits_seen));
}

TEST(Random, IsPhiloxOfTheNumberOfDrawsUnderSeedAndStream) {
  constexpr std::uint64_t kSeed = 0x0123'4567'89AB'CDEF, kStream = 0xFEDC'BA98'7654'3210;
  Random random(kSeed, kStream);
  for (std::uint32_t i = 0; i < 1000; ++i) {
    ASSERT_EQ(random.drawn(), i);
    ASSERT_EQ(random.next(), philox({i / 4, 0, 0x7654'3210, 0xFEDC'BA98}, {0x89AB'CDEF, 0x0123'4567})[i % 4]) << i;
  }
}

TEST(Random, RepeatsAnyDrawFromSeedStreamAndDrawn) {
  Random random(5, 6);
  for (int i = 0; i < 777; ++i) static_cast<void>(i % 3 == 0 ? random.next() : bits(random.normal()));
  Random again(5, 6);
  while (again.drawn() < random.drawn()) again.next();
  for (int i = 0; i < 100; ++i) ASSERT_EQ(bits(again.normal()), bits(random.normal()));
  Random copy = random;
  for (int i = 0; i < 100; ++i) ASSERT_EQ(copy.next(), random.next());
}

TEST(Random, DrawsOneWordForAUniformAndTwoForANormal) {
  Random random(1);
  static_cast<void>(random.uniform());
  EXPECT_EQ(random.drawn(), 1U);
  static_cast<void>(random.uniform_positive());
  EXPECT_EQ(random.drawn(), 2U);
  static_cast<void>(random.normal());
  EXPECT_EQ(random.drawn(), 4U);
}

TEST(Random, HasOtherWordsForEveryBitOfSeedAndStream) {
  std::set<std::uint64_t> firsts;
  const auto first = [](Random random) { return std::uint64_t{random.next()} << 32 | random.next(); };
  firsts.insert(first(Random(0, 0)));
  for (int bit = 0; bit < 64; ++bit) {
    firsts.insert(first(Random(std::uint64_t{1} << bit, 0)));
    firsts.insert(first(Random(0, std::uint64_t{1} << bit)));
  }
  EXPECT_EQ(firsts.size(), 129U);
}

TEST(Uniform, IsInItsRangeAndAMultipleOfTwoToTheMinus24) {
  Random random(11);
  float smallest = 1.0F, largest = 0.0F;
  for (int i = 0; i < 2'000'000; ++i) {
    Random same = random;
    const float u = random.uniform();
    ASSERT_TRUE(u >= 0.0F && u < 1.0F);
    ASSERT_EQ(u * 0x1p+24F, std::floor(u * 0x1p+24F));
    ASSERT_EQ(same.uniform_positive(), u + 0x1p-24F);  // so it is in (0, 1]
    smallest = std::min(smallest, u), largest = std::max(largest, u);
  }
  EXPECT_LT(smallest, 1e-5F);
  EXPECT_GT(largest, 1.0F - 1e-5F);
}

TEST(Uniform, FillsItsBinsAndPairsOfBinsAsChanceDoes) {
  constexpr int kDraws = 1 << 22;
  for (const std::uint64_t seed : {1U, 2U, 3U, 4U}) {
    Random random(seed);
    std::vector<int> high(256), low(256), pairs(std::size_t{64} * 64);
    std::size_t before = 0;
    for (int i = 0; i < kDraws; ++i) {
      const auto n = static_cast<std::uint32_t>(random.uniform() * 0x1p+24F);
      ++high[n >> 16];
      ++low[n & 255U];
      const std::size_t now = n >> 18;
      if (i % 2 == 1) ++pairs[before * 64 + now];
      before = now;
    }
    EXPECT_TRUE(is_chi_square(pearson(high, kDraws), 255)) << "first 8 bits, seed " << seed;
    EXPECT_TRUE(is_chi_square(pearson(low, kDraws), 255)) << "last 8 bits, seed " << seed;
    EXPECT_TRUE(is_chi_square(pearson(pairs, kDraws / 2), 64 * 64 - 1)) << "pairs, seed " << seed;
  }
}

constexpr int kStreams = 64, kPerStream = 1 << 16;

TEST(Normal, HasMeanVarianceSkewnessAndKurtosisOfTheNormalDistribution) {
  // The mean of the Hermite polynomial He_k of n normal variables has mean 0 and variance k!/n exactly. He_1 to He_4
  // are deviations of mean, variance, skewness and kurtosis. Over the streams each is a chi-square: neither wrong nor
  // too even.
  std::array<double, 4> sums{}, totals{};
  constexpr std::array<double, 4> kFactorial{1, 2, 6, 24};
  for (int stream = 0; stream < kStreams; ++stream) {
    Random random(2026, static_cast<std::uint64_t>(stream));
    std::array<double, 4> mean{};
    for (int i = 0; i < kPerStream; ++i) {
      const auto x = static_cast<double>(random.normal());
      const double x2 = x * x;
      mean[0] += x, mean[1] += x2 - 1, mean[2] += x * (x2 - 3), mean[3] += x2 * (x2 - 6) + 3;
    }
    for (std::size_t k = 0; k < 4; ++k) {
      const double z = mean[k] / std::sqrt(kFactorial[k] * kPerStream);
      sums[k] += z * z;
      totals[k] += z / std::sqrt(kStreams);
    }
  }
  for (std::size_t k = 0; k < 4; ++k) {
    EXPECT_LE(std::abs(totals[k]), kQuantile) << "He_" << k + 1 << " over all draws";
    EXPECT_TRUE(is_chi_square(sums[k], kStreams)) << "He_" << k + 1;
  }
}

/// Probability that Kolmogorov's statistic is below d (Kolmogorov 1933), by whichever of its two series converges.
double kolmogorov(double d) {
  constexpr double kPiDouble = 3.14159265358979324;
  double sum = 0;
  if (d < 1.0) {
    for (int k = 1; k < 12; k += 2) sum += std::exp(-squared(k * kPiDouble / d) / 8.0);
    return std::sqrt(2.0 * kPiDouble) / d * sum;
  }
  for (int k = 1; k < 8; ++k) sum += (k % 2 == 1 ? 2.0 : -2.0) * std::exp(-2.0 * squared(k * d));
  return 1.0 - sum;
}

TEST(Normal, HasTheDistributionFunctionOfTheNormalDistribution) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    constexpr std::size_t kDraws = 1'000'000;
    Random random(seed, 99);
    std::vector<double> x(kDraws);
    for (double& one : x) one = static_cast<double>(random.normal());
    std::sort(x.begin(), x.end());
    double distance = 0;
    for (std::size_t i = 0; i < kDraws; ++i) {
      const double truth = 0.5 * std::erfc(-x[i] / std::sqrt(2.0));
      distance =
          std::max({distance, truth - static_cast<double>(i) / kDraws, static_cast<double>(i + 1) / kDraws - truth});
    }
    const double probability = kolmogorov(distance * std::sqrt(kDraws));
    EXPECT_TRUE(probability > 0.0005 && probability < 0.9995) << probability << ", seed " << seed;
  }
}

TEST(Normal, StaysBelow5Point8AndReachesIt) {
  // The smallest uniform_positive() is 2^-24.
  EXPECT_LT(sqrt(-2.0F * log(0x1p-24F)), 5.8F);
  EXPECT_GT(sqrt(-2.0F * log(0x1p-24F)), 5.7F);
  Random random(3);
  int beyond_3 = 0;
  constexpr int kDraws = 4'000'000;
  for (int i = 0; i < kDraws; ++i) {
    const float x = random.normal();
    ASSERT_LT(std::abs(x), 5.8F);
    beyond_3 += std::abs(x) > 3.0F ? 1 : 0;
  }
  const double expected = kDraws * std::erfc(3.0 / std::sqrt(2.0));
  EXPECT_NEAR(beyond_3, expected, kQuantile * std::sqrt(expected));
}

TEST(Normal, IsNotCorrelatedWithWhatItDrewBeforeNorWithAnotherStreamOrSeed) {
  // A sum of n products of independent normal variables has mean 0 and variance n. Neighbouring streams and seeds are
  // the likely culprits.
  constexpr double kDraws = kPerStream;
  double lag_one = 0, lag_two = 0, streams = 0, seeds = 0;
  for (std::uint64_t i = 0; i < kStreams; ++i) {
    Random a(7, i), next_stream(7, i + 1), next_seed(8, i);
    double before = 0, before_that = 0;
    std::array<double, 4> sum{};
    for (int n = 0; n < kPerStream; ++n) {
      const auto x = static_cast<double>(a.normal());
      sum[0] += x * before;
      sum[1] += x * before_that;
      sum[2] += x * static_cast<double>(next_stream.normal());
      sum[3] += x * static_cast<double>(next_seed.normal());
      before_that = before, before = x;
    }
    lag_one += sum[0] * sum[0] / kDraws, lag_two += sum[1] * sum[1] / kDraws;
    streams += sum[2] * sum[2] / kDraws, seeds += sum[3] * sum[3] / kDraws;
  }
  EXPECT_TRUE(is_chi_square(lag_one, kStreams));
  EXPECT_TRUE(is_chi_square(lag_two, kStreams));
  EXPECT_TRUE(is_chi_square(streams, kStreams));
  EXPECT_TRUE(is_chi_square(seeds, kStreams));
}

}  // namespace
}  // namespace tetap::base
