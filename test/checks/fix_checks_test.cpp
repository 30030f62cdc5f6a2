// SPDX-License-Identifier: Apache-2.0
// The checks of fixes by themselves: agreement of fixes, repetition, and the first fixes. The worth of a fix that
// repeats the error of the one before is tested, too.
#include "tetap/checks/coloured_noise.hpp"
#include "tetap/checks/frozen_position.hpp"
#include "tetap/checks/offset_hypothesis.hpp"
#include "tetap/checks/startup_fix_check.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <random>

namespace tetap::checks {
namespace {

constexpr base::Micros kPeriod{200'000};
constexpr std::int32_t kPersist_us = 60'000'000, kPersistFixes = 120;

/// Fixes with the stated sigma; each test says by how much the filter is off at a time.
class Speaker {
 public:
  template <class Off>
  void speak(OffsetHypothesis& hypothesis, int fixes, Off&& off, float sigma_m = 1, float filter_m2 = 0) {
    for (int i = 0; i < fixes; ++i, now += kPeriod) {
      const auto [east, north] = off(base::seconds(now));
      hypothesis.update(now, east + sigma_m * normal_(engine_), north + sigma_m * normal_(engine_), sigma_m * sigma_m,
                        filter_m2);
    }
  }
  base::Micros now;

 private:
  std::mt19937 engine_{7};
  std::normal_distribution<float> normal_;
};
using Off = std::array<float, 2>;
constexpr auto kFar = [](float) { return Off{100, -30}; };

TEST(OffsetHypothesis, PersistsWhenItIsRepeatedForLongEnoughAndOftenEnough) {
  OffsetHypothesis hypothesis;
  Speaker speaker;
  speaker.speak(hypothesis, 300, kFar);
  EXPECT_FALSE(hypothesis.persisted(base::Micros{kPersist_us}, kPersistFixes)) << "59.8 s";
  speaker.speak(hypothesis, 1, kFar);
  EXPECT_TRUE(hypothesis.persisted(base::Micros{kPersist_us}, kPersistFixes));
  EXPECT_NEAR(hypothesis.east_m(), 100.0F, 0.3F) << "the mean of what they said";
  EXPECT_NEAR(hypothesis.north_m(), -30.0F, 0.3F);
  EXPECT_FALSE(hypothesis.persisted(base::Micros{kPersist_us}, 302)) << "not often enough";
}

TEST(OffsetHypothesis, ARampNeverPersistsHoweverLongItLasts) {
  for (const float speed_mps : {0.2F, 1.0F, 10.0F}) {
    OffsetHypothesis hypothesis;
    Speaker speaker;
    for (int i = 0; i < 3000; ++i) {
      speaker.speak(hypothesis, 1, [&](float t) { return Off{0, speed_mps * t}; });
      ASSERT_FALSE(hypothesis.persisted(base::Micros{kPersist_us}, kPersistFixes)) << speed_mps << " m/s after " << i;
    }
  }
}

TEST(OffsetHypothesis, WhatHoldsAfterARampPersistsFromThenOn) {
  OffsetHypothesis hypothesis;
  Speaker speaker;
  const auto ramp = [](float t) { return Off{0, t < 40 ? t : 40}; };
  speaker.speak(hypothesis, 200, ramp);
  speaker.speak(hypothesis, 250, ramp);
  EXPECT_FALSE(hypothesis.persisted(base::Micros{kPersist_us}, kPersistFixes)) << "90 s, but only 50 s the same";
  speaker.speak(hypothesis, 70, ramp);
  EXPECT_TRUE(hypothesis.persisted(base::Micros{kPersist_us}, kPersistFixes));
  EXPECT_NEAR(hypothesis.north_m(), 40.0F, 1.0F);
}

TEST(OffsetHypothesis, AFewThatContradictItAreLeftOutManyBeginAnother) {
  OffsetHypothesis hypothesis;
  Speaker speaker;
  speaker.speak(hypothesis, 100, kFar);
  speaker.speak(hypothesis, 4, [](float) { return Off{-500, 0}; });
  speaker.speak(hypothesis, 200, kFar);
  EXPECT_TRUE(hypothesis.persisted(base::Micros{kPersist_us}, kPersistFixes));
  EXPECT_NEAR(hypothesis.east_m(), 100.0F, 0.3F) << "what contradicts is not in the mean";
  speaker.speak(hypothesis, 5, [](float) { return Off{-500, 0}; });
  EXPECT_FALSE(hypothesis.confirmed(2));
  EXPECT_NEAR(hypothesis.east_m(), -500.0F, 5.0F);
}

TEST(OffsetHypothesis, TheFilterMayDriftMeanwhileByItsOwnUncertaintyAndNoFurther) {
  const auto drift = [](float t) { return Off{0.2F * t, 0}; };  // 12 m in a minute
  OffsetHypothesis judged, excused;
  Speaker speaker;
  for (int i = 0; i < 301; ++i, speaker.now += kPeriod) {
    const float t = base::seconds(speaker.now), off = drift(t)[0];
    judged.update(speaker.now, off, 0, 1.0F, 4.0F);
    excused.update(speaker.now, off, 0, 1.0F, 4.0F + 0.1F * t * t);
  }
  EXPECT_FALSE(judged.persisted(base::Micros{kPersist_us}, kPersistFixes));
  EXPECT_TRUE(excused.persisted(base::Micros{kPersist_us}, kPersistFixes));
}

TEST(OffsetHypothesis, SaysWhatAnotherSaidWithinTheirUncertainty) {
  OffsetHypothesis hypothesis;
  Speaker speaker;
  speaker.speak(hypothesis, 20, kFar);
  EXPECT_TRUE(hypothesis.agrees(101, -31, 2));
  EXPECT_FALSE(hypothesis.agrees(107, -30, 2));
  EXPECT_FALSE(hypothesis.agrees(-100, 30, 2));
}

sensor::GnssPosition fix_at(std::int64_t latitude_2ndeg, std::int64_t longitude_2ndeg, float height_m = 500) {
  return {.latitude_2ndeg = latitude_2ndeg,
          .longitude_2ndeg = longitude_2ndeg,
          .height_m = height_m,
          .horizontal_acc_m = 1,
          .vertical_acc_m = 2,
          .fix = sensor::GnssFix::k3d};
}
constexpr std::int64_t kLatitude = 24'131'350'000, kLongitude = 5'834'150'000;
constexpr double kMetre_2ndeg = 1 / (2e-9 * 111'320);  ///< to the north

TEST(FrozenPosition, TheSameCoordinatesAreFrozenOnceTheFilterHasMovedOn) {
  FrozenPosition frozen;
  const sensor::GnssPosition same = fix_at(kLatitude, kLongitude);
  EXPECT_FALSE(frozen.update(same, 0.3F, 0.0F, 0.5F));
  EXPECT_FALSE(frozen.update(same, -0.1F, 0.0F, 0.5F)) << "0.4 m";
  EXPECT_TRUE(frozen.update(same, -0.3F, 0.0F, 0.5F)) << "0.6 m";
  EXPECT_TRUE(frozen.update(same, 0.3F, 0.0F, 0.5F)) << "a robot that comes back thaws nothing";
  EXPECT_FALSE(frozen.update(fix_at(kLatitude, kLongitude + 1), -3.0F, 0.0F, 0.5F)) << "the last digit differs";
  EXPECT_FALSE(frozen.frozen());
}

TEST(FrozenPosition, StandingStillIsNotFrozenAndEachCoordinateCounts) {
  FrozenPosition frozen;
  for (int i = 0; i < 1000; ++i) EXPECT_FALSE(frozen.update(fix_at(kLatitude, kLongitude), 1.0F, 2.0F, 0.5F));
  for (int i = 1; i < 30; ++i) {
    const auto off = static_cast<float>(i);
    EXPECT_FALSE(frozen.update(fix_at(kLatitude + i, kLongitude), off, 0, 0.5F));
    EXPECT_FALSE(frozen.update(fix_at(kLatitude + i, kLongitude - i - 1), off + 0.9F, 0, 0.5F));
    EXPECT_FALSE(frozen.update(fix_at(kLatitude + i, kLongitude - i - 1, off), off, 0, 0.5F));
  }
}

TEST(StartupFixCheck, CountWhenSoManyFollowEachOther) {
  StartupFixCheck first;
  base::Micros now{1'000'000};
  for (int i = 1; i <= 10; ++i, now += kPeriod)
    EXPECT_EQ(first.update(fix_at(kLatitude + i, kLongitude), now, 5), i >= 5) << i;
}

TEST(StartupFixCheck, AGlitchFirstOrInTheMiddleBeginsNothing) {
  for (const int glitch : {1, 3, 4}) {
    StartupFixCheck first;
    base::Micros now{1'000'000};
    for (int i = 1; i <= 20; ++i, now += kPeriod) {
      const auto off = static_cast<std::int64_t>(i == glitch ? 100 * kMetre_2ndeg : 0);
      const int after = i > glitch ? i - glitch : 0;
      EXPECT_EQ(first.update(fix_at(kLatitude, kLongitude + off), now, 5), after >= 5) << i;
    }
  }
}

TEST(StartupFixCheck, MayComeFromACarAndFromSlowReceivers) {
  for (const std::int64_t period_us : {100'000, 1'000'000}) {
    StartupFixCheck first;
    bool counts = false;
    for (int i = 0; i < 5; ++i) {
      const double way_m = 40e-6 * static_cast<double>(i * period_us);
      counts = first.update(fix_at(kLatitude + static_cast<std::int64_t>(way_m * kMetre_2ndeg), kLongitude),
                            {1'000'000 + i * period_us}, 5);
    }
    EXPECT_TRUE(counts);
  }
}

/// The mean of n samples of a Gauss-Markov error of variance 1 has this variance (sum over all covariances).
double variance_of_mean(int n, double phi) {
  double sum = n;
  for (int k = 1; k < n; ++k) sum += 2 * (n - k) * std::pow(phi, k);
  return sum / n / n;
}

TEST(Repeated, ManyFixesTellAsMuchAsTheirErrorsLeave) {
  // One in full, then n - 1 that repeat: the filter's own sum of information against the true variance of their mean.
  for (const float tau_s : {1.0F, 10.0F, 60.0F})
    for (const double lasting : {10.0, 30.0, 100.0}) {
      const int n = static_cast<int>(lasting * static_cast<double>(tau_s) / 0.2);
      const double information = 1 + (n - 1) / static_cast<double>(repeated(0.2F, tau_s));
      const double truth = variance_of_mean(n, std::exp(-0.2 / static_cast<double>(tau_s)));
      EXPECT_NEAR(1 / information, truth, 0.25 * truth) << tau_s << " s, " << n;
      EXPECT_GE(1 / information, 0.75 * truth);
    }
}

TEST(Repeated, WhatAFilterMakesOfThemIsNeverWorseThanItSays) {
  // The first fix has the weight 1, the others 1 / repeated(): the variance of that mean, from all covariances.
  const double phi = std::exp(-0.2 / 20), weight = 1 / static_cast<double>(repeated(0.2F, 20.0F));
  double sum = 0, squares = 0, with_last = 0, worst = 0;  // of the weights; of the mean; of the sum with the last
  for (int n = 0; n < 5000; ++n) {
    const double w = n == 0 ? 1 : weight;
    with_last *= phi;
    squares += 2 * w * with_last + w * w;
    with_last += w;
    sum += w;
    worst = std::max(worst, squares / (sum * sum) * sum);
  }
  EXPECT_LT(worst, static_cast<double>(kColouredNoiseInflation));
  EXPECT_GT(worst, 0.98 * static_cast<double>(kColouredNoiseInflation)) << "and no more is added than is needed";
}

/// Errors of 1 sigma: the share within `factor` times an accuracy figure that is off by a fifth, from half to twice.
double share_within(double factor) {
  constexpr int kSteps = 12'000;
  double share = 0, weights = 0;
  for (int i = -kSteps; i <= kSteps; ++i) {
    const double sigmas = 6.0 * i / kSteps, weight = std::exp(-0.5 * sigmas * sigmas);
    share += weight * std::erf(factor * std::clamp(1 + 0.2 * sigmas, 0.5, 2.0) / std::sqrt(2.0));
    weights += weight;
  }
  return share / weights;
}

TEST(FirstOfMany, ThreeSigmaHoldsWhatItPromisesWithAFigureThatIsOff) {
  const double promised = std::erf(3 / std::sqrt(2.0)), three_sigma = 3 * static_cast<double>(kStartPositionInflation);
  EXPECT_GE(share_within(three_sigma), promised);
  EXPECT_LT(share_within(0.98 * three_sigma), promised) << "and no more is added than is needed";
}

TEST(Repeated, AFixAfterALongSilenceAndWhiteErrorsCountInFull) {
  EXPECT_EQ(repeated(0.2F, 0.0F), 1.0F);
  EXPECT_NEAR(repeated(300.0F, 60.0F), 1.0F, 0.02F);
  EXPECT_EQ(repeated(1e6F, 60.0F), 1.0F);
  EXPECT_NEAR(repeated(0.2F, 60.0F), 600.0F, 1.0F);
  float last = repeated(0.0F, 60.0F);
  EXPECT_TRUE(base::is_finite(last)) << "two fixes under one stamp";
  for (float t = 0.1F; t < 700.0F; t *= 1.3F) {
    EXPECT_LT(repeated(t, 60.0F), last * 1.0001F);
    last = repeated(t, 60.0F);
    EXPECT_GE(last, 1.0F);
  }
  EXPECT_EQ(repeated(base::kNan, 60.0F), 1.0F);
}

}  // namespace
}  // namespace tetap::checks
