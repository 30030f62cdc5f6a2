// SPDX-License-Identifier: Apache-2.0
// Models of a tracked target. Every Jacobian stands against central differences in double, motion against fine
// integration of its differential equation, noise against the effect of the noise inputs.
#include "support/numeric_jacobian.hpp"
#include "tetap/filter/ekf.hpp"
#include "tetap/model/constant_acceleration.hpp"
#include "tetap/model/constant_velocity.hpp"
#include "tetap/model/radar.hpp"
#include "tetap/model/target_bearing.hpp"
#include "tetap/model/target_position.hpp"
#include "tetap/model/target_range.hpp"

#include <gtest/gtest.h>
#include <cmath>
#include <vector>

namespace tetap {
namespace {

using Turning = model::CtrvState<double>;
using Four = filter::VectorState<double, 4>;
using Six = filter::VectorState<double, 6>;

Turning turning(double x, double y, double v, double yaw, double rate) { return {{x, y, v, yaw, rate}}; }

std::vector<Turning> states() {
  return {turning(1, 2, 3, 0.4, 0.5),   turning(-5, 1, 2, 3.1, 0.3),     turning(4, -7, -1.5, -3.1, -0.4),
          turning(0, 3, 5, 1.5, 1e-7),  turning(2, 2, 1, -1.2, 0.0),     turning(-3, -3, 4, 2.0, 3.5),
          turning(8, 1, 2, 0.1, -2.05), turning(-2, 0.01, 1, -2.5, 1.99)};
}

TEST(Ctrv, JacobianEqualsCentralDifferences) {
  for (const double dt : {0.05, 0.1, 1.0})
    for (const Turning& x : states()) {
      const model::Ctrv<double> motion{.dt_s = dt};
      EXPECT_LT((motion.jacobian(x) - test::numeric_motion_jacobian(motion, x, 1e-5)).cwiseAbs().maxCoeff(), 1e-8)
          << x.value.transpose();
    }
}

// dx/dt = v cos yaw, dy/dt = v sin yaw, dyaw/dt = rate; midpoint rule in 100000 steps.
TEST(Ctrv, FollowsTheArcOfItsDifferentialEquation) {
  for (const Turning& from : states()) {
    double x = from.value(0), y = from.value(1);
    constexpr int kSteps = 100000;
    constexpr double kDt = 0.7, kStep = kDt / kSteps;
    for (int i = 0; i < kSteps; ++i) {
      const double yaw = from.value(3) + from.value(4) * (i + 0.5) * kStep;
      x += from.value(2) * kStep * std::cos(yaw);
      y += from.value(2) * kStep * std::sin(yaw);
    }
    const Turning got = model::Ctrv<double>{.dt_s = kDt}.predict(from);
    EXPECT_NEAR(got.value(0), x, 1e-9);
    EXPECT_NEAR(got.value(1), y, 1e-9);
    EXPECT_EQ(got.value(2), from.value(2));
    EXPECT_NEAR(std::remainder(got.value(3) - from.value(3) - kDt * from.value(4), 2 * M_PI), 0, 1e-14);
    EXPECT_LE(std::abs(got.value(3)), M_PI);
  }
}

TEST(Ctrv, NoiseIsTheInputsVarianceThroughTheNumericJacobian) {
  const model::Ctrv<double> motion{.dt_s = 0.3, .acceleration_variance = 2.0, .yaw_acceleration_variance = 0.7};
  for (const Turning& x : states()) {
    Eigen::Matrix<double, 5, 5> expected = Eigen::Matrix<double, 5, 5>::Zero();
    for (int c = 0; c < 2; ++c) {
      filter::Vector<double, 2> w = filter::Vector<double, 2>::Zero();
      w(c) = 1e-4;
      const filter::Vector<double, 5> g = motion.predict(x, w).minus(motion.predict(x, -w)) / 2e-4;
      expected += motion.noise()(c) * g * g.transpose();
    }
    EXPECT_LT((motion.noise(x).dense() - expected).cwiseAbs().maxCoeff(), 1e-10);
  }
}

TEST(ConstantAcceleration, MovesAsAParabolaAndItsNoiseIsOneIncrement) {
  const model::ConstantAcceleration<double> motion{.dt_s = 0.5, .increment_variance = 3.0};
  const Six x{{1, 2, 4, -1, -2, -6}};
  EXPECT_LT((motion.jacobian(x) - test::numeric_motion_jacobian(motion, x, 1e-4)).norm(), 1e-9);
  const Six next = motion.predict(x);
  const filter::Vector<double, 6> expected{1 + 1 + 0.5, 2 + 2, 4, -1 - 1 - 0.75, -2 - 3, -6};
  EXPECT_LT((next.value - expected).norm(), 1e-14);
  const auto q = motion.noise(x);
  // An increment da moves position by da dt^2/2, velocity by da dt, acceleration by da.
  const double g[] = {0.125, 0.5, 1.0};
  for (int axis = 0; axis < 6; axis += 3)
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) {
        EXPECT_DOUBLE_EQ(q(axis + r, axis + c), 3.0 * g[r] * g[c]);
        EXPECT_EQ(q(r, 3 + c), 0.0);
      }
}

template <class State>
State example();
template <>
Four example<Four>() {
  return {{3, 0.5, -4, 1.5}};
}
template <>
Six example<Six>() {
  return {{3, 0.5, 0.1, -4, 1.5, 0.2}};
}
template <>
Turning example<Turning>() {
  return turning(3, -4, 2, 2.5, 0.3);
}

template <class State>
class TargetMeasurement : public testing::Test {};
using States = testing::Types<Four, Six, Turning>;
TYPED_TEST_SUITE(TargetMeasurement, States);

TYPED_TEST(TargetMeasurement, JacobianEqualsCentralDifferences) {
  const TypeParam x = example<TypeParam>();
  const auto check = [&](const auto& model) {
    EXPECT_LT((model.jacobian(x) - test::numeric_measurement_jacobian(model, x, 1e-5)).cwiseAbs().maxCoeff(), 1e-8);
  };
  check(model::Radar<TypeParam>{.sensor_x_m = 1.0, .sensor_y_m = -0.5});
  check(model::TargetBearing<TypeParam>{.sensor_x_m = -2.0});
  check(model::TargetRange<TypeParam>{.sensor_y_m = 3.0});
  check(model::TargetPosition<TypeParam>{});
}

// The 3-4-5 triangle: at (3, -4) from the sensor, moving at (0.5, 1.5).
TEST(Radar, SeesRangeBearingAndTheRateAlongTheLineOfSight) {
  const model::Radar<Four> radar{.sensor_x_m = 10, .sensor_y_m = 20};
  const auto z = radar.predict({{13, 0.5, 16, 1.5}});
  EXPECT_DOUBLE_EQ(z(0), 5.0);
  EXPECT_DOUBLE_EQ(z(1), std::atan2(-4.0, 3.0));
  EXPECT_DOUBLE_EQ(z(2), (3 * 0.5 - 4 * 1.5) / 5);
  const model::Radar<Turning> other{};
  const auto same = other.predict(turning(3, -4, std::hypot(0.5, 1.5), std::atan2(1.5, 0.5), 0));
  EXPECT_NEAR(same(2), z(2), 1e-14);
}

TEST(Radar, ATargetOnTheSensorGivesNumbers) {
  const model::Radar<Four> radar{};
  const Four on{{0, 1, 0, 1}};
  EXPECT_TRUE(radar.predict(on).allFinite());
  EXPECT_TRUE(radar.jacobian(on).allFinite());
}

TEST(Radar, BearingTakesTheShortWayRound) {
  EXPECT_NEAR(model::Radar<Four>{.bearing_rad = 3.1}.residual({0, -3.1, 0})(1), 6.2 - 2 * M_PI, 1e-14);
  EXPECT_NEAR(model::TargetBearing<Four>{.bearing_rad = -3.1}.residual(filter::Vector<double, 1>{3.1})(0),
              2 * M_PI - 6.2, 1e-14);
}

TEST(Wrapped, TakesWholeTurnsOff) {
  for (int turns = -1000; turns <= 1000; turns += 7)
    for (const double angle : {0.0, 1.0, -3.0, 3.14}) {
      EXPECT_NEAR(filter::wrapped(angle + turns * 2 * M_PI), angle, 1e-12);
      EXPECT_NEAR(filter::wrapped(static_cast<float>(angle + turns * 2 * M_PI)), angle, 4e-4);
    }
}

TEST(AngleBetween, IsTheArcTangentOverTheWholeTurn) {
  for (int i = -3141; i <= 3141; ++i) {
    const double angle = i * 1e-3;
    const auto cross = static_cast<float>(7.0 * std::sin(angle)), dot = static_cast<float>(7.0 * std::cos(angle));
    const double truth = std::atan2(static_cast<double>(cross), static_cast<double>(dot));
    EXPECT_NEAR(static_cast<double>(filter::angle_between(cross, dot)), truth, 2.5e-7 * std::abs(truth)) << angle;
  }
}

}  // namespace
}  // namespace tetap
