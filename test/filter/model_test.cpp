// SPDX-License-Identifier: Apache-2.0
// Laws of every model, each named in a list with a few examples. Its Jacobian, its noise and "a perfect measurement
// changes nothing" are tested.
#include "support/numeric_jacobian.hpp"
#include "tetap/filter/ekf.hpp"
#include "tetap/model/bearing.hpp"
#include "tetap/model/constant_velocity.hpp"
#include "tetap/model/differential_drive.hpp"
#include "tetap/model/gnss_position.hpp"
#include "tetap/model/range.hpp"
#include "tetap/model/range_bearing.hpp"
#include "tetap/model/unicycle.hpp"

#include <gtest/gtest.h>
#include <cmath>
#include <vector>

namespace tetap {
namespace {

using model::PlanarPose;

PlanarPose pose(float x_m, float y_m, float yaw_rad) {
  return {.x = base::Anchored{}.plus(x_m), .y = base::Anchored{}.plus(y_m), .yaw_rad = yaw_rad};
}
model::Landmark landmark(float x_m, float y_m) {
  return {.x = base::Anchored{}.plus(x_m), .y = base::Anchored{}.plus(y_m)};
}

std::vector<PlanarPose> poses() {
  return {pose(0, 0, 0), pose(1, -2, 1.5F), pose(-3, 4, -3.1F), pose(5, 5, 3.1F), pose(0.1F, 0, -1.5708F)};
}

// -- measurement models
// ------------------------------------------------------------------------------------------------------------

template <class Model>
struct Examples;

constexpr model::PlanarMounting kMounting{.x_b_m = 0.3F, .y_b_m = -0.1F, .yaw_rad = 0.2F};

template <>
struct Examples<model::RangeBearing> {
  static model::RangeBearing at(const PlanarPose& x) {
    model::RangeBearing m{
        .sigma_range_m = 0.1F, .sigma_bearing_rad = 0.02F, .landmark = landmark(2, 7), .mounting = kMounting};
    const auto z = m.predict(x);
    return m.range_m = z(0), m.bearing_rad = z(1), m;
  }
};
template <>
struct Examples<model::Range> {
  static model::Range at(const PlanarPose& x) {
    model::Range m{.sigma_range_m = 0.1F, .landmark = landmark(-4, 1), .mounting = kMounting};
    return m.range_m = m.predict(x)(0), m;
  }
};
template <>
struct Examples<model::Bearing> {
  static model::Bearing at(const PlanarPose& x) {
    model::Bearing m{.sigma_bearing_rad = 0.02F, .landmark = landmark(9, -3), .mounting = kMounting};
    return m.bearing_rad = m.predict(x)(0), m;
  }
};
template <>
struct Examples<model::GnssPosition> {
  static model::GnssPosition at(const PlanarPose& x) {
    model::GnssPosition m{.sigma_m = 1.5F, .antenna_x_b_m = -0.4F, .antenna_y_b_m = 0.2F};
    const auto antenna = m.predict(x);  // with the fix at the origin
    m.x = base::Anchored{}.plus(antenna(0));
    m.y = base::Anchored{}.plus(antenna(1));
    return m;
  }
};

template <class Model>
class MeasurementLaws : public testing::Test {};
using Measurements = testing::Types<model::RangeBearing, model::Range, model::Bearing, model::GnssPosition>;
TYPED_TEST_SUITE(MeasurementLaws, Measurements);

TYPED_TEST(MeasurementLaws, JacobianEqualsCentralDifferences) {
  for (const PlanarPose& x : poses()) {
    const auto m = Examples<TypeParam>::at(x);
    const auto h = m.jacobian(x);
    const auto numeric = test::numeric_measurement_jacobian(m, x, 0.01F);
    for (int r = 0; r < TypeParam::kDimension; ++r) {
      filter::Vector<float, 3> row = filter::Vector<float, 3>::Zero();
      for (std::size_t k = 0; k < TypeParam::kTouches.size(); ++k)
        row(TypeParam::kTouches[k]) = h(r, static_cast<int>(k));
      for (int c = 0; c < 3; ++c) EXPECT_NEAR(row(c), numeric(r, c), 2e-3F * (1 + std::abs(row(c)))) << r << c;
    }
  }
}

TYPED_TEST(MeasurementLaws, APerfectMeasurementLeavesTheStateAndShrinksTheCovariance) {
  for (const PlanarPose& x : poses()) {
    filter::Ekf<PlanarPose> ekf{.x = x, .p = filter::Symmetric<float, 3>::diagonal({1, 1, 0.1F})};
    const auto innovation = ekf.update(Examples<TypeParam>::at(x), 9.0F);
    ASSERT_EQ(innovation.verdict, filter::Verdict::kAccepted);
    EXPECT_LT(innovation.nis, 1e-6F);
    EXPECT_LT(ekf.x.minus(x).norm(), 1e-4F);
    EXPECT_TRUE(ekf.p.positive_definite());
    EXPECT_LT(ekf.p(0, 0) + ekf.p(1, 1) + ekf.p(2, 2), 2.1F);
  }
}

TYPED_TEST(MeasurementLaws, SensorFarFromTheOriginSeesTheSame) {
  for (const PlanarPose& x : poses()) {
    const auto near = Examples<TypeParam>::at(x);
    PlanarPose far = x;
    far.x.anchor_um += 50'000'000'000;  // 50 km east
    far.y.anchor_um -= 30'000'000'000;
    auto moved = near;
    if constexpr (requires { moved.landmark; }) {
      moved.landmark.x.anchor_um += 50'000'000'000;
      moved.landmark.y.anchor_um -= 30'000'000'000;
    } else {
      moved.x.anchor_um += 50'000'000'000;
      moved.y.anchor_um -= 30'000'000'000;
    }
    EXPECT_EQ(moved.predict(far), near.predict(x));
    EXPECT_EQ(moved.jacobian(far), near.jacobian(x));
  }
}

TEST(RangeBearing, BearingIsMeasuredFromAheadCounterClockwise) {
  const model::RangeBearing m{.landmark = landmark(0, 5)};
  EXPECT_NEAR(m.predict(pose(0, 0, 0))(1), 1.5708F, 1e-5F)
      << "a landmark to the north of a robot looking east is on its left";
  EXPECT_NEAR(m.predict(pose(0, 0, 1.5708F))(1), 0.0F, 1e-5F);
  EXPECT_FLOAT_EQ(m.predict(pose(3, 1, 0))(0), 5.0F);
}

TEST(RangeBearing, ResidualTakesTheShortWayRound) {
  const model::RangeBearing m{.range_m = 1, .bearing_rad = 3.1F};
  EXPECT_NEAR(m.residual({1.0F, -3.1F})(1), 6.2F - 6.2831853F, 1e-5F);
}

// -- motion models
// -----------------------------------------------------------------------------------------------------------------

std::vector<model::PlanarIncrement> increments() {
  std::vector<model::PlanarIncrement> all;
  for (const model::Arc arc : {model::Arc::kExact, model::Arc::kMidpoint})
    for (const float dyaw : {0.0F, 1e-4F, 0.05F, -0.19F, 0.21F, 1.5F, -3.0F})
      all.push_back(
          {.ds_m = 0.7F, .dyaw_rad = dyaw, .var_ds = 0.01F, .cov_ds_dyaw = 0.001F, .var_dyaw = 0.02F, .arc = arc});
  return all;
}

TEST(PlanarIncrement, JacobianEqualsCentralDifferences) {
  for (const PlanarPose& x : poses())
    for (const auto& increment : increments())
      EXPECT_LT((increment.jacobian(x) - test::numeric_motion_jacobian(increment, x, 0.01F)).norm(), 1e-3F);
}

TEST(PlanarIncrement, NoiseIsTheInputCovarianceThroughTheNumericJacobian) {
  for (const PlanarPose& x : poses())
    for (const auto& increment : increments()) {
      Eigen::Matrix<float, 3, 2> g;
      for (int c = 0; c < 2; ++c) {
        auto plus = increment, minus = increment;
        (c == 0 ? plus.ds_m : plus.dyaw_rad) += 0.01F;
        (c == 0 ? minus.ds_m : minus.dyaw_rad) -= 0.01F;
        g.col(c) = plus.predict(x).minus(minus.predict(x)) / 0.02F;
      }
      Eigen::Matrix2f cov;
      cov << increment.var_ds, increment.cov_ds_dyaw, increment.cov_ds_dyaw, increment.var_dyaw;
      EXPECT_LT((increment.noise(x).dense() - g * cov * g.transpose()).norm(), 3e-4F);
    }
}

TEST(PlanarIncrement, ExactArcDrivesACircleHomeInFewSteps) {
  for (const int steps : {3, 4, 7, 100}) {
    PlanarPose x = pose(1, 2, 0.3F);
    const float turn = 6.28318531F / static_cast<float>(steps);
    for (int i = 0; i < steps; ++i) x = model::PlanarIncrement{.ds_m = 2.0F * turn, .dyaw_rad = turn}.predict(x);
    EXPECT_NEAR(x.x.minus(base::Anchored{}), 1.0F, 2e-5F) << steps;
    EXPECT_NEAR(x.y.minus(base::Anchored{}), 2.0F, 2e-5F) << steps;
    EXPECT_NEAR(x.yaw_rad, 0.3F, 1e-5F);
  }
}

TEST(PlanarIncrement, MidpointApproachesTheArcWithTheThirdPowerOfTheTurn) {
  const auto gap = [](float turn) {
    const model::PlanarIncrement exact{.ds_m = 100.0F * turn, .dyaw_rad = turn};
    auto midpoint = exact;
    midpoint.arc = model::Arc::kMidpoint;
    return static_cast<double>(exact.predict(pose(0, 0, 0)).minus(midpoint.predict(pose(0, 0, 0))).norm());
  };
  // chord error r dyaw^3 / 24
  EXPECT_NEAR(gap(0.8F), 100.0 * 0.512 / 24.0, 0.05);
  EXPECT_NEAR(gap(0.8F) / gap(0.4F), 8.0, 0.3);
}

TEST(DifferentialDrive, CountsBecomeTravelByTheWheelsCircumference) {
  const model::DifferentialDrive drive{
      .left_radius_m = 0.1F, .right_radius_m = 0.2F, .track_m = 0.5F, .counts_per_turn = 1000};
  EXPECT_NEAR(drive.left_m(1000), 0.6283185F, 1e-6F);
  EXPECT_NEAR(drive.right_m(-500), -0.6283185F, 1e-6F);
}

// Siegwart et al. 2011, eq. 5.9-5.13: P' = J_pose P J_pose^T + J_enc Q_enc J_enc^T, written out for the midpoint form.
TEST(DifferentialDrive, CovarianceIsTheTextbooks) {
  const model::DifferentialDrive drive{.track_m = 0.4F, .noise_left = 0.002F, .noise_right = 0.003F};
  const float left = 0.30F, right = 0.34F, yaw = 0.7F;
  const auto increment = drive.increment(left, right, model::Arc::kMidpoint);
  const float ds = 0.32F, dyaw = 0.1F;
  EXPECT_FLOAT_EQ(increment.ds_m, ds);
  EXPECT_NEAR(increment.dyaw_rad, dyaw, 1e-6F);
  const float c = std::cos(yaw + dyaw / 2), s = std::sin(yaw + dyaw / 2), b = 0.4F;
  Eigen::Matrix<float, 3, 2> j;  // columns: right, left
  j << 0.5F * c - ds / (2 * b) * s, 0.5F * c + ds / (2 * b) * s, 0.5F * s + ds / (2 * b) * c,
      0.5F * s - ds / (2 * b) * c, 1 / b, -1 / b;
  const Eigen::Matrix2f q = Eigen::Vector2f(0.003F * right, 0.002F * left).asDiagonal();
  Eigen::Matrix3f f = Eigen::Matrix3f::Identity();
  f(0, 2) = -ds * s;
  f(1, 2) = ds * c;
  filter::Ekf<PlanarPose> ekf{.x = pose(0, 0, yaw), .p = filter::Symmetric<float, 3>::diagonal({0.01F, 0.02F, 0.03F})};
  const Eigen::Matrix3f expected = f * ekf.p.dense() * f.transpose() + j * q * j.transpose();
  ekf.predict(increment);
  EXPECT_LT((ekf.p.dense() - expected).norm(), 1e-7F);
}

TEST(DifferentialDrive, CountersWrapBothWays) {
  EXPECT_EQ(model::count_difference(3, 65534), 5);
  EXPECT_EQ(model::count_difference(65534, 3), -5);
  EXPECT_EQ(model::count_difference(7, 7), 0);
  for (std::int32_t step : {1, -1, 32767, -32768, 12345})
    for (std::uint32_t from : {0U, 1U, 40000U, 65535U})
      EXPECT_EQ(model::count_difference(static_cast<std::uint16_t>(from + static_cast<std::uint32_t>(step)),
                                        static_cast<std::uint16_t>(from)),
                step);
}

TEST(Unicycle, NoiseGrowsWithTimeAndMotion) {
  const model::UnicycleNoise noise{.speed = 0.1F,
                                   .speed_per_speed = 0.2F,
                                   .yaw_rate = 0.3F,
                                   .yaw_rate_per_yaw_rate = 0.4F,
                                   .yaw_rate_per_speed = 0.5F};
  const auto i = model::Unicycle{.forward_mps = -2, .yaw_rate_radps = -3, .noise = noise}.increment(0.5F);
  EXPECT_FLOAT_EQ(i.ds_m, -1.0F);
  EXPECT_FLOAT_EQ(i.dyaw_rad, -1.5F);
  EXPECT_FLOAT_EQ(i.var_ds, 0.5F * (0.1F + 0.4F));
  EXPECT_FLOAT_EQ(i.var_dyaw, 0.5F * (0.3F + 1.2F + 1.0F));
}

}  // namespace
}  // namespace tetap
