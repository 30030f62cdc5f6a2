// SPDX-License-Identifier: Apache-2.0
#include "node/bench.hpp"

#include <gtest/gtest.h>
#include <algorithm>
#include <cmath>

namespace tetap::test {
namespace {

using estimators::DeadReckoning;

double x_of(const estimators::Estimate& e) { return static_cast<double>(e.pose.x.minus(base::Anchored{})); }
double y_of(const estimators::Estimate& e) { return static_cast<double>(e.pose.y.minus(base::Anchored{})); }

TEST(DeadReckoning, CountsDriveACircleHome) {
  DeadReckoning motion;
  motion.start({0}, {}, 0.001F, 0.001F);
  // left 3000 and right 5000 counts a second: v = 1.2566 m/s, yaw rate = 1.2566 rad/s, radius 1 m: home after 5 s
  for (int k = 0; k <= 500; ++k)
    motion.fuse(
        sensor::WheelCounts{.left = static_cast<std::uint16_t>(30 * k), .right = static_cast<std::uint16_t>(50 * k)},
        {10'000 * k}, kNumbers);
  motion.advance({5'000'000});
  const auto e = motion.estimate(kNumbers);
  EXPECT_NEAR(x_of(e), 0.0, 2e-3);
  EXPECT_NEAR(y_of(e), 0.0, 2e-3);
  EXPECT_NEAR(static_cast<double>(e.forward_mps), 0.2 * M_PI / 2000 * 4000, 1e-4);
  EXPECT_TRUE(e.p.positive_definite());
}

TEST(DeadReckoning, AnUpdateBetweenCountsDoesNotCountTravelTwice) {
  DeadReckoning plain, interrupted;
  for (auto* motion : {&plain, &interrupted}) motion->start({0}, {}, 0.01F, 0.01F);
  for (int k = 0; k <= 200; ++k) {
    if (k > 0) interrupted.propagate({10'000 * k - 4'000}, kNumbers);  // where a measurement would be fused
    const sensor::WheelCounts counts{.left = static_cast<std::uint16_t>(33 * k),
                                     .right = static_cast<std::uint16_t>(31 * k + (k % 7))};
    plain.fuse(counts, {10'000 * k}, kNumbers);
    interrupted.fuse(counts, {10'000 * k}, kNumbers);
  }
  for (auto* motion : {&plain, &interrupted}) motion->advance({2'000'000});
  const auto a = plain.estimate(kNumbers), b = interrupted.estimate(kNumbers);
  EXPECT_NEAR(x_of(a), x_of(b), 1e-4);
  EXPECT_NEAR(y_of(a), y_of(b), 1e-4);
  EXPECT_NEAR(a.pose.yaw_rad, b.pose.yaw_rad, 1e-5F);
}

TEST(DeadReckoning, ExtrapolationToTheTickDoesNotChangeTheState) {
  DeadReckoning a, b;
  for (auto* motion : {&a, &b}) motion->start({0}, {}, 0.01F, 0.01F);
  for (int k = 1; k < 100; ++k) {
    for (auto* motion : {&a, &b})
      motion->fuse(sensor::BodySpeed{.forward_mps = 1.0F, .yaw_rate_radps = 0.3F}, {15'000 * k}, kNumbers);
    a.advance({15'000 * k + 5'000});
    static_cast<void>(a.estimate(kNumbers));
  }
  for (auto* motion : {&a, &b}) motion->advance({1'500'000});
  EXPECT_EQ(a.estimate(kNumbers).pose.x.offset_m, b.estimate(kNumbers).pose.x.offset_m);
  EXPECT_EQ(a.estimate(kNumbers).p.packed(), b.estimate(kNumbers).p.packed());
}

TEST(DeadReckoning, CommandsHoldForwardMeasurementsBackward) {
  for (const param::Hold hold : {param::Hold::kForward, param::Hold::kBackward}) {
    param::Parameters n = kNumbers;
    n.wheels.hold = hold;
    DeadReckoning motion;
    motion.start({0}, {}, 0.01F, 0.01F);
    motion.fuse(sensor::BodySpeed{.forward_mps = 1.0F}, {0}, n);
    motion.fuse(sensor::BodySpeed{.forward_mps = 3.0F}, {100'000}, n);
    motion.advance({100'000});
    EXPECT_NEAR(x_of(motion.estimate(n)), hold == param::Hold::kForward ? 0.1 : 0.3, 1e-6);
  }
}

TEST(DeadReckoning, SilentWheelsStopTheEstimateAndGrowTheUncertainty) {
  DeadReckoning motion;
  motion.start({0}, {}, 0.01F, 0.01F);
  motion.fuse(sensor::BodySpeed{.forward_mps = 1.0F}, {0}, kNumbers);
  motion.advance({400'000});
  const auto before = motion.estimate(kNumbers);
  EXPECT_TRUE(before.velocity_valid);
  motion.advance({2'000'000});
  const auto after = motion.estimate(kNumbers);
  EXPECT_FALSE(after.velocity_valid);
  EXPECT_EQ(after.forward_mps, 0.0F);
  EXPECT_GT(after.p(0, 0), 0.5F);
}

TEST(DeadReckoning, TheGyroscopeTurnsAndItsBiasIsLearntAtRest) {
  param::Parameters n = kNumbers;
  n.gyro.use = 1;
  n.gyro.bias_time_s = 1;
  n.gyro.noise = 1e-6F;
  DeadReckoning motion;
  motion.start({0}, {}, 0.01F, 0.01F);
  const float bias = 0.02F;
  std::int64_t t = 0;
  const auto second = [&](float forward_mps, float rate_radps) {
    for (int k = 0; k < 100; ++k) {
      t += 10'000;
      motion.fuse(sensor::ImuSample{.dangle_b_rad = {0, 0, (rate_radps + bias) * 0.01F}, .interval_us = 10'000}, {t},
                  n);
      motion.fuse(sensor::BodySpeed{.forward_mps = forward_mps, .yaw_rate_radps = -5.0F}, {t},
                  n);  // wheels that skid tell nothing
    }
  };
  for (int k = 0; k < 9; ++k) second(0.0F, 0.0F);
  motion.advance({t});
  const float yaw_before = motion.estimate(n).pose.yaw_rad;
  second(1.0F, 0.5F);
  motion.advance({t});
  EXPECT_NEAR(motion.estimate(n).pose.yaw_rad - yaw_before, 0.5F, 0.01F);
}

// The turn begins and ends within a second each, and a third of the IMU samples is lost: two of six. Each sample alone
// would show a gap too little or too much turned, always in the sense of the change.
TEST(DeadReckoning, LostImuSamplesCostNoTurnWhereTheRateChanges) {
  param::Parameters n = kNumbers;
  n.gyro.use = 1;
  const auto rate_radps = [](int k) {
    return static_cast<float>(std::min({0.01 * k, 0.5, 0.01 * std::max(200 - k, 0)}));
  };
  double whole_rad = 0, half_rad = 0;
  for (const bool begin : {true, false}) {
    DeadReckoning motion;
    motion.start({0}, {}, 0.001F, 0.001F);
    double turned_rad = 0;
    for (int k = 1; k <= (begin ? 100 : 260); ++k) {
      const base::Micros t{10'000 * k};
      motion.fuse(sensor::WheelSpeeds{.left_mps = 1, .right_mps = 1}, t, n);
      turned_rad += static_cast<double>(rate_radps(k)) * 0.01;
      if (k % 6 == 2 || k % 6 == 3) continue;
      motion.fuse(sensor::ImuSample{.dangle_b_rad = {0, 0, rate_radps(k) * 0.01F}, .interval_us = 10'000}, t, n);
    }
    const double error_rad = static_cast<double>(motion.filter.x.yaw_rad) - turned_rad;
    (begin ? half_rad : whole_rad) = error_rad;
    EXPECT_LT(std::abs(error_rad), 3.0 * std::sqrt(static_cast<double>(motion.filter.p(2, 2))));
  }
  EXPECT_LT(std::abs(half_rad), 0.0005) << "the turn has begun";
  EXPECT_LT(std::abs(whole_rad), 0.0005) << "and ended";
}

// Without its gyroscope the robot turns as its wheels do, and not as the gyroscope last showed.
TEST(DeadReckoning, WithoutItsGyroscopeTheWheelsShowTheTurn) {
  param::Parameters n = kNumbers;
  n.gyro.use = 1;
  DeadReckoning motion;
  motion.start({0}, {}, 0.01F, 0.01F);
  const double per_m = 2000 / (0.2 * M_PI), track_m = static_cast<double>(n.wheels.drive.track_m);
  double left = 0, right = 0, yaw = 0;
  std::int64_t us = 0;
  const auto run = [&](double for_s, double turn_radps, bool imu) {
    for (int k = 0; k < std::lround(100 * for_s); ++k) {
      us += 10'000;
      yaw += turn_radps * 0.01;
      left += (1 - 0.5 * track_m * turn_radps) * 0.01 * per_m, right += (1 + 0.5 * track_m * turn_radps) * 0.01 * per_m;
      if (imu)
        motion.fuse(
            sensor::ImuSample{.dangle_b_rad = {0, 0, static_cast<float>(turn_radps * 0.01)}, .interval_us = 10'000},
            {us}, n);
      motion.fuse(sensor::WheelCounts{.left = static_cast<std::uint16_t>(std::lround(left)),
                                      .right = static_cast<std::uint16_t>(std::lround(right))},
                  {us}, n);
    }
    motion.advance({us});
    return std::remainder(static_cast<double>(motion.estimate(n).pose.yaw_rad) - yaw, 2 * M_PI);
  };
  EXPECT_NEAR(run(5, 0.3, true), 0, 0.01);
  const double timeout_s = 1e-6 * n.wheels.timeout_us;
  EXPECT_NEAR(run(6, -0.3, false), 0, 1.1 * timeout_s * 0.6) << "but for the time-out";
  const double before = run(1, 0.3, true);
  EXPECT_NEAR(run(5, 0.3, true), before, 0.01) << "the gyroscope shows the turn again";
}

/// One metre a second straight ahead, by counters of which some begin at 0 again at `restart_s`.
struct Restarted {
  double error_m = 0;  ///< at the end, from a drive whose counters go on
  int refused = 0;
  float var_x = 0;
};
Restarted restarted(int first_count, bool left, bool right, bool gyro) {
  param::Parameters n = kNumbers;
  n.gyro.use = gyro ? 1 : 0;
  n.wheels.most_mps = 10;
  DeadReckoning motion;
  motion.start({0}, {}, 0.001F, 0.001F);
  constexpr int kRestart = 300, kEnd = 600;
  constexpr double kPerStep = 0.01 * 2000 / (0.2 * M_PI);
  Restarted result;
  for (int k = 1; k <= kEnd; ++k) {
    const base::Micros stamp{10'000 * k};
    if (gyro)
      motion.fuse(sensor::ImuSample{.dangle_b_rad = {0, 0, 0}, .interval_us = 10'000}, stamp - base::Micros{4'000}, n);
    const auto count = [&](bool restarts) {
      const int from = restarts && k >= kRestart ? kRestart : 0;
      return static_cast<std::uint16_t>((from > 0 ? 0 : first_count) + std::lround(kPerStep * (k - from)));
    };
    const auto verdict = motion.fuse(sensor::WheelCounts{.left = count(left), .right = count(right)}, stamp, n);
    if (verdict == sensor::Verdict::kRejected) ++result.refused;
  }
  motion.advance({10'000 * kEnd});
  const auto e = motion.estimate(n);
  result.error_m = std::hypot(x_of(e) - 0.01 * (kEnd - 1), y_of(e));
  result.var_x = e.p(0, 0);
  return result;
}

// Every count at which a step to 0 is faster than the wheel's 10 m/s: 318 counts in 10 ms.
TEST(DeadReckoning, CountersThatRestartAreRefusedAndCostNoWay) {
  for (const bool gyro : {false, true})
    for (const auto& [left, right] : {std::pair{true, true}, {true, false}, {false, true}})
      for (const int first : {0, 1'000, 9'000, 30'000, 43'310, 60'000, 63'000}) {
        const Restarted r = restarted(first, left, right, gyro);
        EXPECT_EQ(r.refused, 1) << first << left << right << gyro;
        EXPECT_LT(r.error_m, 2e-3) << first << left << right << gyro;
      }
  EXPECT_EQ(restarted(9'000, false, false, true).refused, 0);
}

TEST(DeadReckoning, CountersThatOnlyLeapBecomeSilentWheels) {
  param::Parameters n = kNumbers;
  n.wheels.most_mps = 10;
  DeadReckoning motion;
  motion.start({0}, {}, 0.001F, 0.001F);
  for (int k = 1; k <= 300; ++k) {
    const int count = k < 100 ? 32 * k : 9'000 * (k % 3);
    motion.fuse(
        sensor::WheelCounts{.left = static_cast<std::uint16_t>(count), .right = static_cast<std::uint16_t>(count)},
        {10'000 * k}, n);
  }
  motion.advance({3'000'000});
  const auto e = motion.estimate(n);
  EXPECT_FALSE(e.velocity_valid);
  EXPECT_GT(e.p(0, 0), 0.5F);
  EXPECT_NEAR(x_of(e), 1.0 + 0.5, 0.05);  // the last speed holds until the time-out
}

}  // namespace
}  // namespace tetap::test
