// SPDX-License-Identifier: Apache-2.0
// The planar filter's refusals name their test, and its recovery adds variance to the pose alone.
#include "estimators/planar/pose_ekf.hpp"
#include "config/mrclam.hpp"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace tetap::estimators
