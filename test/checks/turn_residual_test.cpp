// SPDX-License-Identifier: Apache-2.0
// The heading's sigma has to cover the turn by which gyroscope and wheels differ, whichever of them is wrong. It has to
// stay as it is while they differ by no more than their noise. Truth is the difference that the test puts in.
#include "tetap/checks/turn_residual.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace tetap::checks {
namespace {

constexpr float kLimit = 10.6F;
constexpr std::int64_t kPeriod_us = 20'000;

/// Root of all variances that were returned in a run whose turn rates differ by `off_radps` from second 5 for `for_s`.
struct Outcome {
  double sigma_rad = 0;
  bool contradicted = false;
  double back_after_s = 0;  ///< end of the contradiction, from the end of the difference
};
Outcome played(double off_radps, double for_s, double sigma_radps, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  TurnResidual check;
  Outcome found;
  double variance = 0, lasting = 0;
  for (std::int64_t us = kPeriod_us; us < 60'000'000; us += kPeriod_us) {
    const double at_s = 1e-6 * static_cast<double>(us), end_s = 5 + for_s;
    lasting += 0.02 * (-lasting + std::sqrt(2 / 0.02) * sigma_radps * normal(random));  // lasts for a second
    const double off = lasting + (at_s >= 5 && at_s < end_s ? off_radps : 0);
    variance += static_cast<double>(
        check.update(static_cast<float>(off), static_cast<float>(sigma_radps * sigma_radps), kLimit, {us}));
    found.contradicted = found.contradicted || check.contradicts();
    if (check.contradicts() && at_s >= end_s) found.back_after_s = at_s - end_s;
  }
  found.sigma_rad = std::sqrt(variance);
  return found;
}

TEST(TurnResidual, TheSigmaOfTheHeadingFollowsAllOfTheTurnThatTheyDifferBy) {
  for (const double off : {0.05, -0.3, 2.0})
    for (const double for_s : {1.0, 3.0, 10.0}) {
      const Outcome found = played(off, for_s, 0.002, 1);
      const double turned = std::abs(off) * for_s;
      EXPECT_TRUE(found.contradicted) << off << ' ' << for_s;
      EXPECT_GT(found.sigma_rad, 0.8 * turned) << off << ' ' << for_s;
      EXPECT_LT(found.sigma_rad, 1.3 * turned + std::abs(off)) << off << ' ' << for_s;
      EXPECT_LT(found.back_after_s, 6) << off << ' ' << for_s;
    }
}

TEST(TurnResidual, NoiseAsStatedIsNoContradiction) {
  int contradicted = 0;
  for (unsigned seed = 1; seed <= 50; ++seed) contradicted += played(0, 1, 0.06, seed).contradicted ? 1 : 0;
  EXPECT_LE(contradicted, 5) << "50 minutes";
}

TEST(TurnResidual, AfterAPauseOfTheWheelsTheComparisonBeginsAnew) {
  TurnResidual check;
  std::int64_t us = 0;
  const auto differ = [&](double for_s) {
    float variance = 0;
    for (const std::int64_t end = us + std::llround(1e6 * for_s); us < end; us += kPeriod_us)
      variance += check.update(1.0F, 1e-4F, kLimit, {us});
    return variance;
  };
  EXPECT_GT(differ(2), 0.0F);
  us += 1'000'000;
  EXPECT_EQ(check.update(1.0F, 1e-4F, kLimit, {us}), 0.0F);
  EXPECT_FALSE(check.contradicts());
}

TEST(TurnResidual, AfterACorrectionOnlyTheTurnSinceCounts) {
  constexpr float kOff_radps = 1;
  TurnResidual check;
  std::int64_t us = 0;
  const auto variance_of = [&](double for_s) {
    float variance = 0;
    for (const std::int64_t end = us + std::llround(1e6 * for_s); us < end; us += kPeriod_us)
      variance += check.update(kOff_radps, 1e-4F, kLimit, {us});
    return variance;
  };
  static_cast<void>(variance_of(4));
  check.corrected();
  EXPECT_TRUE(check.contradicts());
  EXPECT_NEAR(std::sqrt(variance_of(2)), 2, 0.05);
}

}  // namespace
}  // namespace tetap::checks
