// SPDX-License-Identifier: Apache-2.0
// Laws of the trackers. They follow a target within their uncertainty, and begin anew when it is another one. Ticks
// change no bit, and no measurement leaves them without numbers.
#include "tetap/estimators/target/target_tracker.hpp"
#include "config/tracker.hpp"
#include "config/tracker_ukf.hpp"
#include "support/never_nan.hpp"
#include "tetap/base/bit_crc.hpp"
#include "tetap/base/state_words.hpp"

#include <gtest/gtest.h>
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <random>

namespace tetap::estimators {
namespace {

constexpr std::int64_t kScan_us = 50'000;

/// A target on a circle of 10 m about (12, 3) at 4 m/s, seen by lidar and radar in turn.
template <class E>
struct Scene {
  explicit Scene(const param::Parameters& parameters) : numbers(parameters) { tracker.restart({}, ctx()); }
  [[nodiscard]] Context ctx() const { return {.parameters = numbers, .map_frame = frame}; }
  [[nodiscard]] double x() const { return 12 + 10 * std::cos(angle); }
  [[nodiscard]] double y() const { return 3 + 10 * std::sin(angle); }
  [[nodiscard]] double yaw() const { return std::remainder(angle + M_PI / 2, 2 * M_PI); }
  [[nodiscard]] sensor::LandmarkSighting seen() {
    const auto noise = [this](double sigma) { return std::normal_distribution<double>(0, sigma)(random); };
    const double range = std::hypot(x(), y()), bearing = std::atan2(y(), x());
    if (steps % 2 == 0) {
      const double px = x() + noise(0.15), py = y() + noise(0.15);
      return {.landmark = 0xFF,
              .range_m = static_cast<float>(std::hypot(px, py)),
              .bearing_rad = static_cast<float>(std::atan2(py, px))};
    }
    const double rate = 4 * (x() * std::cos(yaw()) + y() * std::sin(yaw())) / range;
    return {.landmark = 0xFF,
            .range_m = static_cast<float>(range + noise(0.3)),
            .bearing_rad = static_cast<float>(bearing + noise(0.03)),
            .range_rate_mps = static_cast<float>(rate + noise(0.3))};
  }
  void drive(int count) {
    for (int k = 0; k < count; ++k) {
      us += kScan_us;
      angle += 4 * 0.05 / 10;
      ++steps;
      last = tracker.fuse(seen(), {us}, ctx());
      rejected += last.verdict == sensor::Verdict::kRejected ? 1 : 0;
    }
  }
  [[nodiscard]] Estimate estimate() {
    tracker.advance({us}, ctx());
    return tracker.estimate(ctx());
  }
  [[nodiscard]] double error_m() {
    const Estimate e = estimate();
    return std::hypot(static_cast<double>(e.pose.x.minus({})) - x(), static_cast<double>(e.pose.y.minus({})) - y());
  }
  [[nodiscard]] std::uint32_t hash() const {
    base::BitCrc crc;
    base::each_word(tracker, crc);
    return crc.value();
  }

  param::Parameters numbers;
  MapFrame frame;
  E tracker;
  Innovation last;
  std::mt19937 random{3};
  double angle = 0;
  std::int64_t us = 0;
  int steps = 0, rejected = 0;
};

template <class E>
Scene<E> scene() {
  if constexpr (std::is_same_v<E, VelocityTracker>) {
    return Scene<E>(robot::tracker::parameters);
  } else {
    return Scene<E>(robot::tracker_ukf::parameters);
  }
}

template <class E>
class Tracker : public testing::Test {};
using Trackers = testing::Types<VelocityTracker, TurnTracker>;
TYPED_TEST_SUITE(Tracker, Trackers);

TYPED_TEST(Tracker, FollowsWithinItsUncertainty) {
  auto s = scene<TypeParam>();
  s.drive(100);
  EXPECT_EQ(s.rejected, 0);
  double square = 0, sigma2 = 0, speed2 = 0, turn2 = 0;
  constexpr int kLooks = 200;
  for (int k = 0; k < kLooks; ++k) {
    s.drive(5);
    const Estimate e = s.estimate();
    square += s.error_m() * s.error_m();
    sigma2 += static_cast<double>(e.p(0, 0) + e.p(1, 1));
    speed2 += std::pow(static_cast<double>(e.forward_mps) - 4, 2) / kLooks;
    turn2 += std::pow(std::remainder(static_cast<double>(e.pose.yaw_rad) - s.yaw(), 2 * M_PI), 2) / kLooks;
    EXPECT_TRUE(e.position_valid && e.heading_valid && e.velocity_valid);
  }
  EXPECT_LT(square / sigma2, 1.5);
  EXPECT_GT(square / sigma2, 0.3);
  EXPECT_LT(std::sqrt(speed2), 0.6);
  EXPECT_LT(std::sqrt(turn2), 0.2);
  EXPECT_EQ(s.rejected, 0);
}

/// A straight target from (20, 10) by lidar alone: root mean square and largest error, the latter in sigmas.
struct Crossing {
  double square = 0, sigmas = 0;
  int looks = 0, refused = 0;

  template <class E>
  void watch(const param::Parameters& parameters, double dt_s, double speed_mps, double heading, unsigned seed) {
    auto tracker = std::make_unique<E>();
    const MapFrame frame;
    const Context ctx{.parameters = parameters, .map_frame = frame};
    tracker->restart({}, ctx);
    std::mt19937 random(seed);
    std::normal_distribution<double> noise(0, 0.15);
    for (int k = 1; k <= 40; ++k) {
      const double x = 20 + speed_mps * k * dt_s * std::cos(heading), y = 10 + speed_mps * k * dt_s * std::sin(heading);
      const double px = x + noise(random), py = y + noise(random);
      const base::Micros t{std::llround(k * dt_s * 1e6)};
      const Innovation seen = tracker->fuse({.landmark = 0xFF,
                                             .range_m = static_cast<float>(std::hypot(px, py)),
                                             .bearing_rad = static_cast<float>(std::atan2(py, px))},
                                            t, ctx);
      refused += seen.verdict == sensor::Verdict::kAccepted ? 0 : 1;
      tracker->advance(t, ctx);
      const Estimate e = tracker->estimate(ctx);
      const Eigen::Vector2d d(static_cast<double>(e.pose.x.minus({})) - x, static_cast<double>(e.pose.y.minus({})) - y);
      Eigen::Matrix2d p;
      p << static_cast<double>(e.p(0, 0)), static_cast<double>(e.p(0, 1)), static_cast<double>(e.p(0, 1)),
          static_cast<double>(e.p(1, 1));
      square += d.squaredNorm();
      sigmas = std::max(sigmas, std::sqrt(d.dot(p.inverse() * d)));
      ++looks;
    }
  }
};

TEST(TurnTracker, FollowsATargetThatCrossesAsTheVelocityTrackerDoes) {
  for (const double dt_s : {0.1, 0.5, 1.0})
    for (const double speed_mps : {1.0, 3.0, 8.0}) {
      Crossing straight, turn;
      for (unsigned k = 0; k < 200; ++k) {
        const double heading = 2 * M_PI * k / 200;
        straight.watch<VelocityTracker>(robot::tracker::parameters, dt_s, speed_mps, heading, k);
        turn.watch<TurnTracker>(robot::tracker_ukf::parameters, dt_s, speed_mps, heading, k);
      }
      const double ratio = std::sqrt(turn.square / straight.square);
      std::printf(
          "%.1f s, %.0f m/s: %.3f m, %.2f of the velocity tracker's; worst %.1f and %.1f sigma, refused %d and %d\n",
          dt_s, speed_mps, std::sqrt(turn.square / turn.looks), ratio, turn.sigmas, straight.sigmas, turn.refused,
          straight.refused);
      EXPECT_LT(ratio, 1.2);
      EXPECT_LT(turn.sigmas, 1.25 * std::max(straight.sigmas, 4.0));  // 8000 looks: Gaussian errors reach 4.2 sigma
      EXPECT_EQ(turn.refused, 0);
    }
}

TYPED_TEST(Tracker, TicksChangeNoBit) {
  auto quiet = scene<TypeParam>(), ticked = scene<TypeParam>();
  for (int k = 0; k < 100; ++k) {
    quiet.drive(3), ticked.drive(3);
    for (std::int64_t ahead_us = 0; ahead_us < kScan_us; ahead_us += 10'000) {
      ticked.tracker.advance({ticked.us + ahead_us}, ticked.ctx());
      static_cast<void>(ticked.tracker.estimate(ticked.ctx()));
    }
    ASSERT_EQ(quiet.hash(), ticked.hash()) << k;
  }
}

TYPED_TEST(Tracker, APoseFromOutsideIsTakenAsItIs) {
  auto s = scene<TypeParam>();
  s.drive(20);
  s.tracker.set_pose(
      {s.us}, {.pose = {.x = base::Anchored{}.plus(-4), .y = base::Anchored{}.plus(9)}, .sigma_position_m = 0.5F},
      s.ctx());
  const Estimate e = s.estimate();
  EXPECT_EQ(e.pose.x.minus({}), -4);
  EXPECT_EQ(e.pose.y.minus({}), 9);
  EXPECT_NEAR(e.p(0, 0), 0.25F, 1e-6F);
  EXPECT_FALSE(e.heading_valid);
}

TYPED_TEST(Tracker, ATargetThatIsElsewhereIsATrackOfItsOwnAfterFiveRefusals) {
  auto s = scene<TypeParam>();
  s.drive(100);
  s.rejected = 0;
  s.angle += 2;
  s.drive(5);
  EXPECT_EQ(s.rejected, 5);
  EXPECT_GT(s.error_m(), 3);
  EXPECT_EQ(s.tracker.mode(s.ctx()), sensor::Mode::kDegraded);
  s.drive(100);
  EXPECT_LT(s.error_m(), 0.6);
}

TYPED_TEST(Tracker, WithoutMeasurementsTheTrackEnds) {
  auto s = scene<TypeParam>();
  s.drive(100);
  const Estimate before = s.estimate();
  s.us += 1'900'000;
  const Estimate later = s.estimate();
  EXPECT_TRUE(later.position_valid);
  EXPECT_GT(later.p(0, 0), 4 * before.p(0, 0));
  s.us += 200'000;
  EXPECT_FALSE(s.estimate().position_valid);
  EXPECT_EQ(s.tracker.mode(s.ctx()), sensor::Mode::kWaitingForPose);
}

TYPED_TEST(Tracker, NoMeasurementLeavesItWithoutNumbers) {
  for (const float value : test::kHostile)
    for (int field = 0; field < 3; ++field) {
      auto s = scene<TypeParam>();
      s.drive(field == 0 ? 0 : 20);
      for (int k = 0; k < 8; ++k) {
        s.drive(1);
        sensor::LandmarkSighting sighting{.landmark = 0xFF, .range_m = 15, .bearing_rad = 0.2F, .range_rate_mps = 1};
        float* const fields[] = {&sighting.range_m, &sighting.bearing_rad, &sighting.range_rate_mps};
        *fields[field] = value;
        if (base::abs(value) > 1e5F) continue;  // never passes the plausibility test
        static_cast<void>(s.tracker.fuse(sighting, {s.us}, s.ctx()));
        const Estimate e = s.estimate();
        EXPECT_TRUE(e.pose.finite()) << field << " = " << value;
        EXPECT_GT(test::least_eigenvalue(e.p), 0) << field << " = " << value;
      }
    }
}

}  // namespace
}  // namespace tetap::estimators
