// SPDX-License-Identifier: Apache-2.0
// The planar filter's refusals name their test, and its recovery adds variance to the pose alone.
#include "tetap/estimators/planar/pose_ekf.hpp"
#include "config/mrclam.hpp"
#include "config/rover_landmarks.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace tetap::estimators {
namespace {

/// At the origin, sure of it, with one landmark 5 m ahead.
struct Robot {
  Robot() {
    static_cast<void>(map.put({.x_mm = 5000, .id = 7}));
    frame.map = &map;
    estimator.restart({}, ctx());
    estimator.set_pose({}, {.sigma_position_m = 0.05F, .sigma_yaw_rad = 0.02F}, ctx());
  }
  [[nodiscard]] Context ctx() const { return {.parameters = robot::mrclam::parameters, .map_frame = frame}; }
  Innovation sees(float range_m, float bearing_rad) {
    us += 100'000;
    return estimator.fuse(sensor::LandmarkSighting{.landmark = 7, .range_m = range_m, .bearing_rad = bearing_rad}, {us},
                          ctx());
  }

  LandmarkMap<kMapCapacity> map;
  MapFrame frame;
  PoseEkf estimator;
  std::int64_t us = 0;
};

TEST(PoseEkf, ARefusalNamesItsTest) {
  Robot robot;
  const Innovation right = robot.sees(5.0F, 0.0F);
  EXPECT_EQ(right.verdict, sensor::Verdict::kAccepted);
  EXPECT_EQ(right.failed, sensor::Check::kNone);
  const Innovation wrong = robot.sees(9.0F, 1.0F);
  EXPECT_EQ(wrong.verdict, sensor::Verdict::kRejected);
  EXPECT_EQ(wrong.failed, sensor::Check::kGate);
  const Innovation nothing = robot.sees(base::kNan, base::kNan);
  EXPECT_EQ(nothing.verdict, sensor::Verdict::kNotFinite);
  EXPECT_EQ(nothing.failed, sensor::Check::kValue);
}

TEST(PoseEkf, RecoveryAddsTheConfiguredVariances) {
  Robot robot;
  const param::RecoveryParameters& n = robot::mrclam::parameters.recovery;
  const auto before = robot.estimator.estimate(robot.ctx()).p;
  for (std::uint16_t k = 0; k < n.at_least; ++k) EXPECT_EQ(robot.sees(9.0F, 1.0F).failed, sensor::Check::kGate);
  const auto after = robot.estimator.estimate(robot.ctx()).p;
  EXPECT_NEAR(after(0, 0) - before(0, 0), n.inflate_position_m * n.inflate_position_m, 1e-6F);
  EXPECT_NEAR(after(1, 1) - before(1, 1), n.inflate_position_m * n.inflate_position_m, 1e-6F);
  EXPECT_NEAR(after(2, 2) - before(2, 2), n.inflate_yaw_rad * n.inflate_yaw_rad, 1e-6F);
  EXPECT_FLOAT_EQ(after(0, 1), before(0, 1));
}

/// The same sighting with and without its identity, among landmarks 2 m apart.
TEST(PoseEkf, ASightingWithoutIdentityIsThatOfTheLandmarkItFitsBest) {
  Robot named, nameless;
  for (Robot* robot : {&named, &nameless})
    for (const MapEntry& entry : {MapEntry{5000, 2000, 8}, MapEntry{5000, -2000, 9}})
      ASSERT_TRUE(robot->map.put(entry));
  const auto sees = [](Robot& robot, std::uint8_t landmark, float range_m, float bearing_rad) {
    robot.us += 100'000;
    return robot.estimator.fuse(
        sensor::LandmarkSighting{.landmark = landmark, .range_m = range_m, .bearing_rad = bearing_rad}, {robot.us},
        robot.ctx());
  };
  const Innovation with = sees(named, 8, 5.4F, 0.36F), without = sees(nameless, 0xFF, 5.4F, 0.36F);
  EXPECT_EQ(without.verdict, sensor::Verdict::kAccepted);
  EXPECT_EQ(without.landmark, 8);
  EXPECT_EQ(with.nis, without.nis);
  const Estimate a = named.estimator.estimate(named.ctx()), b = nameless.estimator.estimate(nameless.ctx());
  EXPECT_EQ(a.pose.x.minus(b.pose.x), 0);
  EXPECT_EQ(a.p.packed(), b.p.packed());
  EXPECT_EQ(sees(nameless, 0xFF, 9.0F, 3.0F).verdict, sensor::Verdict::kRejected);
  EXPECT_EQ(sees(nameless, 0xFF, base::kNan, base::kNan).verdict, sensor::Verdict::kNotFinite);
  nameless.estimator.restart({nameless.us}, nameless.ctx());  // without a pose there is no nearest
  EXPECT_EQ(sees(nameless, 0xFF, 5.4F, 0.36F).verdict, sensor::Verdict::kNotUsed);
}

TEST(PoseEkf, TheModeStaysDegradedWhenTheCovarianceIsWidened) {
  Robot robot;
  for (int k = 1; k <= 15; ++k) {
    ASSERT_EQ(robot.sees(50.0F, 0.0F).verdict, sensor::Verdict::kRejected) << k;
    EXPECT_EQ(robot.estimator.mode(robot.ctx()), k < 3 ? sensor::Mode::kNominal : sensor::Mode::kDegraded) << k;
  }
}

/// The planar rover stands at the origin, 4 m from one landmark and 5 m from another, in sight of fixes and counters.
struct Standing {
  struct Motion {
    double left_mps = 0, right_mps = 0;  ///< rims, as the counters show them
    double turn_radps = 0;               ///< as the gyroscope shows it
  };
  explicit Standing(unsigned seed) : random(seed) {
    static_cast<void>(map.put({.x_mm = 4000, .id = 7}));
    static_cast<void>(map.put({.y_mm = 5000, .id = 8}));
    frame.map = &map;
    frame.frame = nav::LocalFrame(n.gnss.origin_latitude_2ndeg, n.gnss.origin_longitude_2ndeg, n.gnss.origin_height_m);
    frame.origin = sensor::OriginSource::kConfigured;
    estimator.restart({}, ctx());
    estimator.set_pose({}, {.sigma_position_m = 0.05F, .sigma_yaw_rad = 0.02F}, ctx());
    run(5, {});
    beyond_s = 0;
  }
  [[nodiscard]] Context ctx() const { return {.parameters = n, .map_frame = frame}; }
  /// 100 Hz of wheels and IMU, 5 Hz of landmarks and fixes.
  void run(double for_s, const Motion& shown) {
    const double per_m = static_cast<double>(n.wheels.drive.counts_per_turn) / (2 * 3.14159265358979 * 0.1);
    for (int k = 0; k < std::lround(100 * for_s); ++k) {
      us += 10'000;
      left += shown.left_mps * 0.01 * per_m, right += shown.right_mps * 0.01 * per_m;
      estimator.fuse(
          sensor::ImuSample{.dangle_b_rad = {0, 0, static_cast<float>(shown.turn_radps * 0.01)}, .interval_us = 10'000},
          {us}, ctx());
      estimator.fuse(sensor::WheelCounts{static_cast<std::uint16_t>(std::lround(left)),
                                         static_cast<std::uint16_t>(std::lround(right))},
                     {us}, ctx());
      if (us % 200'000 == 0) {
        sight();
        fix();
      }
      estimator.advance({us}, ctx());
      judge();
    }
  }
  /// As from `place_m` east of the origin the landmarks, as from `fix_east_m` the fixes.
  void sight() {
    if (landmarks < 1) return;
    const double range7_m = 4 - place_m + range_off_m, range8_m = std::hypot(place_m, 5.0),
                 bearing8_rad = std::atan2(5.0, -place_m);
    const auto noise = [this](double sigma) { return static_cast<float>(sigma * normal(random)); };
    estimator.fuse(sensor::LandmarkSighting{.landmark = 7,
                                            .range_m = static_cast<float>(range7_m) + noise(0.1),
                                            .bearing_rad = static_cast<float>(bearing_off_rad) + noise(0.02)},
                   {us}, ctx());
    if (landmarks < 2) return;
    estimator.fuse(sensor::LandmarkSighting{.landmark = 8,
                                            .range_m = static_cast<float>(range8_m) + noise(0.1),
                                            .bearing_rad = static_cast<float>(bearing8_rad) + noise(0.02)},
                   {us}, ctx());
  }
  void fix() {
    constexpr double kEquator_m = 6378137, kPi = 3.14159265358979;
    const double latitude_rad = static_cast<double>(n.gnss.origin_latitude_2ndeg) * 1e-9 * kPi / 90,
                 per_m_2ndeg = 90 / kPi * 1e9 / kEquator_m,
                 east_2ndeg = fix_east_m * per_m_2ndeg / std::cos(latitude_rad);
    estimator.fuse(
        sensor::GnssPosition{.latitude_2ndeg = n.gnss.origin_latitude_2ndeg + std::llround(fix_north_m * per_m_2ndeg),
                             .longitude_2ndeg = n.gnss.origin_longitude_2ndeg + std::llround(east_2ndeg),
                             .height_m = n.gnss.origin_height_m,
                             .horizontal_acc_m = 0.3F,
                             .vertical_acc_m = 0.5F,
                             .fix = sensor::GnssFix::k3d},
        {us}, ctx());
  }
  void judge() {
    const Estimate e = estimator.estimate(ctx());
    const auto ratio = [&e](double off, int k) {
      return std::abs(off) / (3 * std::sqrt(static_cast<double>(e.p(k, k))));
    };
    const double x = 1e-6 * static_cast<double>(e.pose.x.um()), y = 1e-6 * static_cast<double>(e.pose.y.um());
    const double worst = std::max({ratio(x, 0), ratio(y, 1), ratio(static_cast<double>(e.pose.yaw_rad), 2)});
    if (worst > 1.5) beyond_s += 0.01;
  }

  param::Parameters n = robot::rover_landmarks::parameters;
  LandmarkMap<kMapCapacity> map;
  MapFrame frame;
  PoseEkf estimator;
  std::mt19937 random;
  std::normal_distribution<double> normal;
  std::int64_t us = 0;
  double left = 0, right = 0;
  double place_m = 0, fix_east_m = 0, fix_north_m = 0;  ///< places that landmarks and fixes show
  double range_off_m = 0, bearing_off_rad = 0;          ///< errors of landmark 7
  int landmarks = 2;                                    ///< in sight
  double beyond_s = 0;                                  ///< time in which an error was above 1.5 times three sigma
};

TEST(PoseEkf, AGyroscopeOrWheelsThatErrAtRestLeaveThePoseHonest) {
  const Standing::Motion wrong[] = {{.turn_radps = 0.1}, {.turn_radps = -1.0}, {.left_mps = 0.3}, {.right_mps = -1.2}};
  for (const Standing::Motion& shown : wrong)
    for (unsigned seed = 1; seed <= 3; ++seed) {
      Standing robot(seed);
      robot.run(5, shown);
      robot.run(10, {});
      EXPECT_LT(robot.beyond_s, 1.0) << shown.left_mps << ' ' << shown.right_mps << ' ' << shown.turn_radps;
    }
}

double sigma_m(const Standing& robot) {
  const Estimate e = robot.estimator.estimate(robot.ctx());
  return std::sqrt(static_cast<double>(std::max(e.p(0, 0), e.p(1, 1))));
}

void expect_no_vote(const Standing& robot, unsigned seed) {
  EXPECT_LT(sigma_m(robot), 0.3) << seed;
  EXPECT_EQ(robot.beyond_s, 0) << seed;
}

TEST(PoseEkf, LandmarksAndFixesThatShowOnePlaceOutvoteTheMotion) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    Standing robot(seed);
    robot.place_m = robot.fix_east_m = -6;
    robot.run(0.4, {});
    EXPECT_EQ(robot.estimator.mode(robot.ctx()), sensor::Mode::kDegraded) << seed;
    robot.run(0.6, {});
    EXPECT_NEAR(1e-6 * static_cast<double>(robot.estimator.estimate(robot.ctx()).pose.x.um()), -6, 0.5) << seed;
    EXPECT_EQ(robot.estimator.mode(robot.ctx()), sensor::Mode::kDegraded) << seed;
    robot.run(12, {});
    EXPECT_EQ(robot.estimator.mode(robot.ctx()), sensor::Mode::kNominal) << seed;
  }
}

/// Two places: fixes leap to 30 m, and two sightings of the one landmark in sight are 16 m off.
TEST(PoseEkf, AFixThatLeapsBesideAWrongSightingIsNoVote) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    Standing robot(seed);
    robot.fix_east_m = 30;
    robot.landmarks = 1;
    robot.range_off_m = 16;
    robot.run(0.4, {});
    EXPECT_LT(sigma_m(robot), 0.3) << seed;
    robot.range_off_m = 0;
    robot.run(1, {});
    expect_no_vote(robot, seed);
  }
}

/// A range that fits both places, beside a wrong bearing and a fix that leaps sideways.
TEST(PoseEkf, AWrongBearingIsNoEvidenceForAFix) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    Standing robot(seed);
    robot.fix_north_m = 5;
    robot.bearing_off_rad = 0.4;
    robot.landmarks = 1;
    robot.run(0.4, {});
    expect_no_vote(robot, seed);
  }
}

TEST(PoseEkf, OneSightingThatAgreesWithALeapIsNoVote) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    Standing robot(seed);
    robot.place_m = robot.fix_east_m = -6;
    robot.landmarks = 1;
    robot.run(0.2, {});
    robot.landmarks = 0;
    robot.run(0.4, {});
    expect_no_vote(robot, seed);
  }
}

/// A receiver whose error stays 0.75 m for two minutes, 1.5 of its sigmas; no landmark is in sight.
TEST(PoseEkf, FixesWhoseErrorLastsWeighLess) {
  for (const float correlation_s : {0.0F, 60.0F}) {
    Standing robot(1);
    robot.n.gnss.correlation_s = correlation_s;
    robot.n.gnss.sigma_scale = 1;
    robot.n.gnss.sigma_floor_m = 0.5F;
    robot.estimator.set_pose({robot.us}, {.sigma_position_m = 2, .sigma_yaw_rad = 0.02F}, robot.ctx());
    robot.fix_east_m = 0.75;
    robot.landmarks = 0;
    robot.run(120, {});
    const double error_m = 1e-6 * static_cast<double>(robot.estimator.estimate(robot.ctx()).pose.x.um());
    if (correlation_s > 0) {
      EXPECT_LT(error_m, 3 * sigma_m(robot));
      EXPECT_LT(sigma_m(robot), 0.75);  // two minutes are two independent fixes of 0.5 m, and more
    } else {
      EXPECT_GT(error_m, 3 * sigma_m(robot));
    }
  }
}

/// The fixes of before have no part in the new pose, so the next one repeats nothing.
TEST(PoseEkf, TheFirstFixAfterAPoseThatIsGivenCountsInFull) {
  Standing robot(1);
  robot.n.gnss.correlation_s = 60;
  robot.n.gnss.sigma_scale = 1;
  robot.n.gnss.sigma_floor_m = 0.5F;
  robot.landmarks = 0;
  robot.run(2, {});
  robot.estimator.set_pose({robot.us}, {.sigma_position_m = 2, .sigma_yaw_rad = 0.02F}, robot.ctx());
  robot.run(0.2, {});
  EXPECT_LT(sigma_m(robot), 0.6);
  EXPECT_GT(sigma_m(robot), 0.5);
}

}  // namespace
}  // namespace tetap::estimators
