// SPDX-License-Identifier: Apache-2.0
// Laws of the planar filters, whatever their kind. Ticks do not change the state, and a pose from outside is taken as
// it is. No sensor makes them lose their numbers, and GNSS finds the heading of each. With small noise the unscented
// filters are the extended one.
#include "tetap/estimators/planar/pose_ukf.hpp"
#include "estimators/circling_robot.hpp"
#include "support/never_nan.hpp"
#include "tetap/estimators/planar/pose_ekf.hpp"

#include <gtest/gtest.h>

namespace tetap::estimators {
namespace {

using test::held_backward;
using test::kStep_us;

template <class E>
class PlanarFilter : public testing::Test {};
using Filters = testing::Types<PoseEkf, PoseUkf, PoseUkfSqrt>;
TYPED_TEST_SUITE(PlanarFilter, Filters);

TYPED_TEST(PlanarFilter, TracksWithinItsUncertainty) {
  test::CirclingRobot<TypeParam> robot(held_backward());
  robot.set(0, 0, 0, 0.05F, 0.02F);
  double square = 0, sigma2 = 0;
  constexpr int kLooks = 60;
  for (int k = 0; k < kLooks; ++k) {
    robot.drive(20);
    const Estimate e = robot.estimate();
    square += robot.error_m() * robot.error_m();
    sigma2 += static_cast<double>(e.p(0, 0) + e.p(1, 1));
    EXPECT_TRUE(e.position_valid);
  }
  EXPECT_LT(square / sigma2, 2.0);  // two correlated degrees of freedom of some 60 looks
  EXPECT_GT(square / sigma2, 0.4);
  for (const sensor::Verdict v : robot.verdicts) EXPECT_EQ(v, sensor::Verdict::kAccepted);
}

TYPED_TEST(PlanarFilter, TicksBetweenSamplesChangeNoBit) {
  test::CirclingRobot<TypeParam> quiet(held_backward()), ticked(held_backward());
  for (auto* robot : {&quiet, &ticked}) robot->set(0, 0, 0, 0.05F, 0.02F);
  for (int k = 0; k < 100; ++k) {
    quiet.drive(7), ticked.drive(7);
    for (std::int64_t ahead_us = 0; ahead_us < kStep_us; ahead_us += 10'000) {
      ticked.estimator.advance({ticked.us + ahead_us}, ticked.ctx());
      static_cast<void>(ticked.estimator.estimate(ticked.ctx()));
    }
    ASSERT_EQ(quiet.hash(), ticked.hash()) << k;
  }
}

TYPED_TEST(PlanarFilter, APoseFromOutsideIsTakenAsItIs) {
  test::CirclingRobot<TypeParam> robot(held_backward());
  robot.set(0, 0, 0, 0.05F, 0.02F);
  robot.drive(100);
  robot.set(3, -2, 1.5F, 0.4F, 0.3F);
  const Estimate e = robot.estimate();
  EXPECT_EQ(e.pose.x.minus({}), 3);
  EXPECT_EQ(e.pose.y.minus({}), -2);
  EXPECT_EQ(e.pose.yaw_rad, 1.5F);
  EXPECT_NEAR(e.p(0, 0), 0.16F, 1e-6F);
  EXPECT_NEAR(e.p(1, 1), 0.16F, 1e-6F);
  EXPECT_NEAR(e.p(2, 2), 0.09F, 1e-6F);
  EXPECT_NEAR(e.p(0, 1), 0, 1e-9F);
  EXPECT_TRUE(e.heading_valid);
}

TYPED_TEST(PlanarFilter, NoSampleLeavesItWithoutNumbers) {
  for (const float value : test::kHostile)
    for (int field = 0; field < 5; ++field) {
      test::CirclingRobot<TypeParam> robot(held_backward());
      robot.set(0, 0, 0, 0.05F, 0.02F);
      robot.drive(20);
      sensor::LandmarkSighting sighting{.landmark = 1, .range_m = 5, .bearing_rad = 0.1F};
      sensor::BodySpeed speed{.forward_mps = 1, .yaw_rate_radps = 0.3F};
      sensor::GnssPosition fix{.latitude_2ndeg = 24'000'000'000,
                               .longitude_2ndeg = 5'500'000'000,
                               .horizontal_acc_m = 1,
                               .fix = sensor::GnssFix::k3d};
      float* const fields[] = {&sighting.range_m, &sighting.bearing_rad, &speed.forward_mps, &speed.yaw_rate_radps,
                               &fix.horizontal_acc_m};
      *fields[field] = value;
      const bool bounded = std::fabs(value) <= 1e3F;  // speeds beyond never pass the plausibility test
      for (int k = 0; k < 3; ++k) {
        robot.us += kStep_us;
        if (field < 2 || field > 3 || bounded) static_cast<void>(robot.estimator.fuse(speed, {robot.us}, robot.ctx()));
        static_cast<void>(robot.estimator.fuse(sighting, {robot.us}, robot.ctx()));
        static_cast<void>(robot.estimator.fuse(fix, {robot.us}, robot.ctx()));
        const Estimate e = robot.estimate();
        EXPECT_TRUE(e.pose.finite()) << field << " = " << value;
        EXPECT_GT(test::least_eigenvalue(e.p), 0) << field << " = " << value;
      }
    }
}

/// Fixes of a straight drive along the heading 2 rad, from a start that is not known.
template <class E>
double aligned_after_m(test::CirclingRobot<E>& robot, double& worst_rad) {
  constexpr double kHeading = 2.0, kPerLat = 111'132.0 * 2e-9, kPerLon = 111'320.0 * 2e-9;
  const double per_lon = kPerLon * std::cos(48 * M_PI / 180);
  for (int k = 0; k < 600; ++k) {
    robot.us += kStep_us;
    const double way = 0.05 * k;
    static_cast<void>(robot.estimator.fuse(sensor::BodySpeed{.forward_mps = 1}, {robot.us}, robot.ctx()));
    const Estimate before = robot.estimate();
    if (!before.heading_valid) {
      EXPECT_GE(before.p(2, 2), 3.2F) << "a heading that could be anything";
    }
    if (k % 10 != 0) continue;
    static_cast<void>(robot.estimator.fuse(
        sensor::GnssPosition{
            .latitude_2ndeg = 24'000'000'000 + static_cast<std::int64_t>(way * std::sin(kHeading) / kPerLat),
            .longitude_2ndeg = 5'500'000'000 + static_cast<std::int64_t>(way * std::cos(kHeading) / per_lon),
            .height_m = 500,
            .horizontal_acc_m = 0.5F,
            .fix = sensor::GnssFix::k3d},
        {robot.us}, robot.ctx()));
    const Estimate e = robot.estimate();
    worst_rad = std::fabs(std::remainder(static_cast<double>(e.pose.yaw_rad) - kHeading, 2 * M_PI));
    if (e.heading_valid) return way;
  }
  return 1e9;
}

TYPED_TEST(PlanarFilter, GnssFindsTheHeadingAsSoonAsForTheExtendedFilter) {
  test::CirclingRobot<PoseEkf> ekf(held_backward());
  test::CirclingRobot<TypeParam> robot(held_backward());
  double ekf_rad = 0, rad = 0;
  const double ekf_m = aligned_after_m(ekf, ekf_rad), m = aligned_after_m(robot, rad);
  EXPECT_LT(ekf_m, 20);
  EXPECT_EQ(m, ekf_m);
  EXPECT_LT(rad, 0.05);
}

template <class E>
class UnscentedFilter : public testing::Test {};
using Unscented = testing::Types<PoseUkf, PoseUkfSqrt>;
TYPED_TEST_SUITE(UnscentedFilter, Unscented);

TYPED_TEST(UnscentedFilter, IsTheExtendedOneWhereNoiseIsSmall) {
  param::Parameters numbers = held_backward();
  numbers.landmark = {.sigma_range_m = 2e-3F, .sigma_bearing_rad = 5e-4F, .gate_scale = 1e6F};
  test::CirclingRobot<PoseEkf> ekf(numbers);
  test::CirclingRobot<TypeParam> ukf(numbers);
  ekf.set(0, 0, 0, 0.01F, 0.005F), ukf.set(0, 0, 0, 0.01F, 0.005F);
  for (int k = 0; k < 50; ++k) {
    ekf.drive(10), ukf.drive(10);
    const Estimate a = ekf.estimate(), b = ukf.estimate();
    const float sigma_m = std::sqrt(a.p(0, 0) + a.p(1, 1));
    EXPECT_NEAR(a.pose.x.minus(b.pose.x), 0, 0.05F * sigma_m + 1e-5F) << k;
    EXPECT_NEAR(a.pose.y.minus(b.pose.y), 0, 0.05F * sigma_m + 1e-5F) << k;
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(b.p(i, i) / a.p(i, i), 1, 0.03F) << k << i;
  }
}

TYPED_TEST(UnscentedFilter, SaysItsKind) {
  EXPECT_EQ(TypeParam::kKind, sensor::EstimatorKind::kUkf);
  EXPECT_EQ(PoseEkf::kKind, sensor::EstimatorKind::kEkf);
}

}  // namespace
}  // namespace tetap::estimators
