// SPDX-License-Identifier: Apache-2.0
// Static fusion of receivers as an estimator: the published formulas, a receiver that fails, one that contradicts, and
// fixes that come late.
#include "tetap/estimators/planar/position_fusion.hpp"
#include "config/fusion2.hpp"
#include "support/never_nan.hpp"
#include "tetap/node/estimator_slot.hpp"

#include <gtest/gtest.h>
#include <cmath>

namespace tetap::estimators {
namespace {

using Inverse = PositionFusion<FusionRule::kInverseVariance>;
using Intersection = PositionFusion<FusionRule::kIntersection>;

template <class E>
struct Site {
  Site() {
    frame.frame = nav::LocalFrame(24'000'000'000, 5'500'000'000, 500.0F);
    frame.origin = sensor::OriginSource::kConfigured;
    estimator.restart({}, ctx());
  }
  [[nodiscard]] Context ctx() const { return {.parameters = robot::fusion2::parameters, .map_frame = frame}; }
  /// A fix so far north of the origin (a step of the latitude is 0.222 mm).
  sensor::Verdict fix(std::uint8_t instance, double north_m, float sigma_m, std::int64_t us) {
    return estimator
        .fuse(sensor::GnssPosition{.latitude_2ndeg =
                                       24'000'000'000 + static_cast<std::int64_t>(north_m / (111'199.05 * 2e-9)),
                                   .longitude_2ndeg = 5'500'000'000,
                                   .height_m = 500,
                                   .horizontal_acc_m = sigma_m,
                                   .fix = sensor::GnssFix::k3d},
              {us}, instance, ctx())
        .verdict;
  }
  [[nodiscard]] Estimate at(std::int64_t us) {
    estimator.advance({us}, ctx());
    return estimator.estimate(ctx());
  }
  MapFrame frame;
  E estimator;
};

TEST(PositionFusion, InverseVarianceIsTheFormula) {
  Site<Inverse> site;
  EXPECT_EQ(site.fix(0, 0, 1, 1'000'000), sensor::Verdict::kAccepted);
  EXPECT_EQ(site.fix(1, 3, 2, 1'000'000), sensor::Verdict::kAccepted);
  const Estimate e = site.at(1'000'000);
  EXPECT_NEAR(e.pose.y.minus({}), 3 * 0.2, 2e-3);
  EXPECT_NEAR(e.p(1, 1), 0.8F, 1e-5F);
  EXPECT_TRUE(e.position_valid);
  EXPECT_FALSE(e.heading_valid);
  EXPECT_EQ(site.estimator.receivers(), 3);
}

TEST(PositionFusion, IntersectionClaimsNoMoreThanTheBetterReceiver) {
  Site<Intersection> site;
  static_cast<void>(site.fix(0, 0, 1, 1'000'000));
  static_cast<void>(site.fix(1, 3, 2, 1'000'000));
  const Estimate e = site.at(1'000'000);
  EXPECT_NEAR(e.p(1, 1), 1.0F, 1e-3F);
  EXPECT_NEAR(e.pose.y.minus({}), 0, 0.01);
}

TEST(PositionFusion, IntersectionOfEqualReceiversIsTheirMean) {
  Site<Intersection> site;
  static_cast<void>(site.fix(0, 0, 2, 1'000'000));
  static_cast<void>(site.fix(1, 3, 2, 1'000'000));
  const Estimate e = site.at(1'000'000);
  EXPECT_NEAR(e.pose.y.minus({}), 1.5, 2e-3);
  EXPECT_NEAR(e.p(0, 0), 4.0F, 1e-3F);
  EXPECT_NEAR(e.p(1, 1), 4.0F, 1e-3F);
}

TEST(PositionFusion, OneReceiverIsEnoughAndNoneIsNotValid) {
  Site<Inverse> site;
  EXPECT_FALSE(site.at(500'000).position_valid);
  static_cast<void>(site.fix(1, 5, 2, 1'000'000));
  EXPECT_NEAR(site.at(1'000'000).pose.y.minus({}), 5, 2e-3);
  EXPECT_NEAR(site.at(1'000'000).p(0, 0), 4, 1e-5F);
  EXPECT_TRUE(site.at(2'900'000).position_valid);
  EXPECT_FALSE(site.at(3'100'000).position_valid);
}

TEST(PositionFusion, AContradictionIsRefusedAndTheNextEpochBeginsAnew) {
  Site<Inverse> site;
  static_cast<void>(site.fix(0, 0, 1, 1'000'000));
  EXPECT_EQ(site.fix(1, 40, 1, 1'000'000), sensor::Verdict::kRejected);
  EXPECT_NEAR(site.at(1'000'000).pose.y.minus({}), 0, 2e-3);
  EXPECT_EQ(site.fix(0, 1, 1, 1'200'000), sensor::Verdict::kAccepted);
  EXPECT_EQ(site.fix(0, 9, 1, 1'200'000), sensor::Verdict::kNotUsed);  // the same receiver again
  EXPECT_EQ(site.fix(1, 1, 1, 1'200'000), sensor::Verdict::kAccepted);
  EXPECT_NEAR(site.at(1'200'000).p(1, 1), 0.5F, 1e-5F);
}

TEST(PositionFusion, TheSlotHandsOverTheInstanceAndALateFixCountsAsOneOnTime) {
  using Slot = node::EstimatorSlot<Inverse>;
  static_assert(Slot::kTakes<sensor::GnssPosition> && !Slot::kTakes<sensor::WheelCounts>);
  const Site<Inverse> site;
  Slot slot;
  slot.restart({}, site.ctx());
  for (std::uint8_t instance = 0; instance < 3; ++instance) {
    sensor::Sample sample;
    sample.stamp = {1'000'000};
    sample.sensor = sensor::Sensor::kGnssPosition;
    sample.instance = instance;
    sample.payload.gnss_position = {.latitude_2ndeg = 24'000'000'000,
                                    .longitude_2ndeg = 5'500'000'000,
                                    .height_m = 500,
                                    .horizontal_acc_m = 3,
                                    .fix = sensor::GnssFix::k3d};
    EXPECT_EQ(slot.fuse(sample, site.ctx()).verdict, sensor::Verdict::kAccepted);
  }
  EXPECT_NEAR(slot.estimate(site.ctx()).p(0, 0), 3, 1e-4F);  // 9 / 3
}

TEST(PositionFusion, NoFixLeavesItWithoutNumbers) {
  for (const float value : test::kHostile)
    for (const bool second : {false, true}) {
      Site<Intersection> site;
      static_cast<void>(site.fix(0, 0, second ? 1.0F : value, 1'000'000));
      static_cast<void>(site.fix(1, 1, second ? value : 1.0F, 1'000'000));
      const Estimate e = site.at(1'000'000);
      EXPECT_TRUE(e.pose.finite()) << value;
      EXPECT_GT(test::least_eigenvalue(e.p), 0) << value;
    }
}

}  // namespace
}  // namespace tetap::estimators
