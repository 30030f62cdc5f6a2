// SPDX-License-Identifier: Apache-2.0
// Laws of the one rule of what an IMU sample is good for: whole, in time, and the same for whoever asks.
#include "tetap/checks/imu_classifier.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>
#include <vector>

namespace tetap::checks {
namespace {

using sensor::ImuSample;
constexpr std::int32_t kStuckAfter = 10;
constexpr param::InertialParameters kSensor{.stuck_samples = kStuckAfter};
constexpr base::Micros kInterval{5'000};

/// Samples with the noise of a sensor; each test spoils what it is about.
class Imu {
 public:
  ImuSample next() {
    ImuSample s{.interval_us = static_cast<std::uint16_t>(kInterval.us)};
    for (std::size_t i = 0; i < 3; ++i) {
      s.dangle_b_rad[i] = 1e-4F * normal_(random_);
      s.dvelocity_b_mps[i] = 1e-3F * normal_(random_);
    }
    s.dvelocity_b_mps[2] += 0.049F;
    return s;
  }

 private:
  std::mt19937 random_{11};
  std::normal_distribution<float> normal_;
};

ImuClass classify(ImuClassifier& classifier, const ImuSample& s, base::Micros pause = {}, bool turn_known = false) {
  return classifier.classify(s, increment_of(s), pause, turn_known, kSensor);
}

TEST(ImuClassifier, ASampleThatBeginsWhereTheLastEndedIsContiguousWhateverItShows) {
  Imu imu;
  ImuClassifier classifier;
  for (int i = 0; i < 1000; ++i) ASSERT_EQ(classify(classifier, imu.next()), ImuClass::kContiguous) << i;
}

// The jitter of drivers' clocks is one number: 1.5 ms to either side of nothing.
TEST(ImuClassifier, AGapBeginsAboveTheJitterAndAnOverlapBeyondHalfOfTheSample) {
  Imu imu;
  ImuClassifier classifier;
  const auto at = [&](std::int64_t pause_us) { return classify(classifier, imu.next(), {pause_us}); };
  EXPECT_EQ(at(1'500), ImuClass::kContiguous);
  EXPECT_EQ(at(1'501), ImuClass::kAfterGap);
  EXPECT_EQ(at(-2'500), ImuClass::kContiguous);
  EXPECT_EQ(at(-2'501), ImuClass::kOverlapping);
}

TEST(ImuClassifier, NoNumberTooFastAndNoIntervalAreInvalidBeforeAllElse) {
  Imu imu;
  std::vector<ImuSample> bad(5, imu.next());
  bad[0].dangle_b_rad[1] = std::nanf("");
  bad[1].dvelocity_b_mps[2] = std::numeric_limits<float>::infinity();
  bad[2].interval_us = 0;
  bad[3].dangle_b_rad[0] = 0.51F;     // 102 rad/s
  bad[4].dvelocity_b_mps[0] = 5.01F;  // 1002 m/s^2
  for (ImuSample& s : bad) {
    s.clipped_gyro = 1;
    ImuClassifier classifier;
    EXPECT_EQ(classify(classifier, s, {10'000}, true), ImuClass::kInvalid);
  }
}

// A value that the sensor cannot have on an axis is no reading of it. The norm of three axes may exceed the range of
// one.
TEST(ImuClassifier, MoreThanTheRangeOfTheSensorIsLeftOutAxisByAxis) {
  Imu imu;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (const float share : {-1.01F, -0.99F, 0.99F, 1.01F}) {
      const ImuClass expected = std::abs(share) > 1 ? ImuClass::kBeyondRange : ImuClass::kContiguous;
      ImuSample fast = imu.next(), hard = imu.next();
      fast.dangle_b_rad[axis] = share * 0.005F * kSensor.gyro_range_radps;
      hard.dvelocity_b_mps[axis] = share * 0.005F * kSensor.accel_range_mps2;
      ImuClassifier one, other;
      EXPECT_EQ(classify(one, fast), expected) << axis << ' ' << share;
      EXPECT_EQ(classify(other, hard), expected) << axis << ' ' << share;
      EXPECT_EQ(ImuClassifier::plain(fast, imu.next(), kSensor), expected == ImuClass::kContiguous);
      EXPECT_EQ(ImuClassifier::plain(imu.next(), hard, kSensor), expected == ImuClass::kContiguous);
    }
  }
  ImuSample all = imu.next();
  all.dangle_b_rad.fill(0.99F * 0.005F * kSensor.gyro_range_radps);
  ImuClassifier classifier;
  EXPECT_EQ(classify(classifier, all), ImuClass::kContiguous);
}

TEST(ImuClassifier, EitherHalfThatRepeatsItselfTenTimesIsStuckUntilItShowsAnother) {
  for (const bool gyro : {false, true}) {
    Imu imu;
    ImuClassifier classifier;
    const ImuSample held = imu.next();
    for (int i = 0; i <= 30; ++i) {
      ImuSample s = imu.next();
      (gyro ? s.dangle_b_rad : s.dvelocity_b_mps) = gyro ? held.dangle_b_rad : held.dvelocity_b_mps;
      EXPECT_EQ(classify(classifier, s) == ImuClass::kStuck, i >= kStuckAfter) << i;
    }
    EXPECT_EQ(classify(classifier, imu.next()), ImuClass::kContiguous);
  }
}

TEST(ImuClassifier, LessThanHalfAStepOfTheBusIsARepetitionAndMoreIsNone) {
  ImuClassifier classifier;
  ImuSample s = Imu().next();
  for (int i = 0; i < 30; ++i) {
    s.dangle_b_rad[0] += 0.3e-6F;
    classify(classifier, s);
  }
  EXPECT_EQ(classify(classifier, s), ImuClass::kStuck);
  s.dangle_b_rad[0] += 1e-6F, s.dvelocity_b_mps[1] += 1e-5F;
  EXPECT_EQ(classify(classifier, s), ImuClass::kContiguous);
}

TEST(ImuClassifier, RepetitionsMayBeSwitchedOff) {
  ImuClassifier classifier;
  const ImuSample s = Imu().next();
  for (int i = 0; i < 300; ++i)
    ASSERT_EQ(classifier.classify(s, increment_of(s), {}, false, {.stuck_samples = 0}), ImuClass::kContiguous) << i;
}

TEST(ImuClassifier, AGyroscopeAtFullScaleIsLeftOutOnlyWhereTheTurnIsKnown) {
  Imu imu;
  ImuClassifier classifier;
  ImuSample s = imu.next();
  s.clipped_gyro = 1;
  EXPECT_EQ(classify(classifier, s, {}, false), ImuClass::kContiguous);
  s = imu.next();
  s.clipped_gyro = 1;
  EXPECT_EQ(classify(classifier, s, {9'000}, true), ImuClass::kSaturated);
  s = imu.next();
  s.clipped_accel = 1;
  EXPECT_EQ(classify(classifier, s, {}, true), ImuClass::kContiguous);
}

// The cells of the output predictor skip classification of plain samples. Law: after any plain sample a fresh state is
// as good as the one that saw all samples.
TEST(ImuClassifier, PlainSamplesAreContiguousAndLeaveNothingBehindButThemselves) {
  std::mt19937 random(3);
  const auto one_in = [&](int n) { return std::uniform_int_distribution<int>(1, n)(random) == 1; };
  Imu imu;
  ImuClassifier all;
  ImuSample before = imu.next();
  classify(all, before);
  int plain = 0, not_plain = 0;
  for (int i = 0; i < 5000; ++i) {
    ImuSample s = one_in(2) && not_plain % 40 < 20 ? before : imu.next();
    if (one_in(15)) s.clipped_gyro = 1;
    if (one_in(15)) s.clipped_accel = 1;
    if (one_in(20)) s.dangle_b_rad[0] = std::nanf("");
    const bool is_plain = ImuClassifier::plain(s, before, kSensor);
    const ImuClass found = classify(all, s, {}, true);
    if (is_plain) {
      ++plain;
      ASSERT_EQ(found, ImuClass::kContiguous) << i;
      ImuClassifier fresh = ImuClassifier::after(s);
      ImuClassifier continued = all;
      for (int k = 0; k < 12; ++k) {
        const ImuSample next = one_in(3) ? imu.next() : s;
        ASSERT_EQ(classify(fresh, next), classify(continued, next)) << i << ' ' << k;
      }
    } else {
      ++not_plain;
    }
    if (found != ImuClass::kInvalid) before = s;
  }
  EXPECT_GT(plain, 500);
  EXPECT_GT(not_plain, 500);
}

}  // namespace
}  // namespace tetap::checks
