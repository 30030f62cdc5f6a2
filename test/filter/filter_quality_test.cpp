// SPDX-License-Identifier: Apache-2.0
// Every filter in a world that is its model: unbiased, consistent, white and efficient over 100 seeds. With Q or R
// wrong by three it is not. Laws that estimators have by name stand below.
#include "support/quality.hpp"

#include "tetap/filter/iterated_ekf.hpp"
#include "tetap/filter/joseph.hpp"
#include "tetap/filter/kalman.hpp"
#include "tetap/filter/sequential.hpp"
#include "tetap/filter/square_root.hpp"
#include "tetap/filter/structured_kalman.hpp"
#include "tetap/filter/ud.hpp"
#include "tetap/filter/ukf.hpp"
#include "tetap/filter/ukf_sqrt.hpp"
#include "tetap/model/constant_velocity.hpp"
#include "tetap/model/planar_increment.hpp"
#include "tetap/model/range_bearing.hpp"
#include "tetap/model/target_bearing.hpp"

#include <gtest/gtest.h>
#include <Eigen/Dense>
#include <cmath>
#include <random>

namespace tetap {
namespace {

using filter::Symmetric;
using filter::Vector;
using filter::VectorState;
using Four = VectorState<float, 4>;

template <class Filter, int N>
void set_covariance(Filter& filter, const Symmetric<float, N>& p) {
  if constexpr (requires { filter.set_covariance(p); }) {
    filter.set_covariance(p);
  } else {
    filter.p = p;
  }
}
template <class Filter>
auto covariance(const Filter& filter) {
  if constexpr (requires { filter.covariance(); }) {
    return filter.covariance();
  } else {
    return filter.p;
  }
}
template <class Filter>
Eigen::MatrixXd exact(const Filter& filter) {
  return covariance(filter).dense().template cast<double>();
}

constexpr int kSeeds = 100;
constexpr int kSteps = 100;

class Normal {
 public:
  explicit Normal(unsigned seed) : random_(seed) {}
  double operator()() { return normal_(random_); }

 private:
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
};

// -- linear: constant velocity, both positions measured
// ------------------------------------------------------------------

constexpr double kAcceleration = 0.5;  // (m/s^2)^2
constexpr double kPosition = 0.25;     // m^2

/// The filter is given Q times q and R times r.
template <class Filter>
test::Quality<4, 2> linear_quality(float q = 1, float r = 1) {
  test::Quality<4, 2> quality(kSteps);
  for (unsigned seed = 0; seed < kSeeds; ++seed) {
    Normal normal(1000 + seed);
    Filter kf;
    set_covariance<Filter, 4>(kf, Symmetric<float, 4>::diagonal({4, 1, 4, 1}));
    Eigen::Vector4d truth(2 * normal(), normal(), 2 * normal(), normal());
    quality.begin_run();
    for (int k = 0; k < kSteps; ++k) {
      for (int axis = 0; axis < 4; axis += 2) {
        const double a = std::sqrt(kAcceleration) * normal();
        truth(axis) += 0.1 * truth(axis + 1) + 0.005 * a;
        truth(axis + 1) += 0.1 * a;
      }
      EXPECT_TRUE(kf.predict(model::ConstantVelocity<float>{
          .dt_s = 0.1F, .acceleration_variance = q * static_cast<float>(kAcceleration)}));
      const float variance = r * static_cast<float>(kPosition);
      const filter::DirectMeasurement<float, 4, 0, 2> z{
          .z = {static_cast<float>(truth(0) + 0.5 * normal()), static_cast<float>(truth(2) + 0.5 * normal())},
          .variance = {variance, variance}};
      const auto innovation = kf.update(z, 1e9F);
      quality.add(k, kf.x.value.template cast<double>() - truth, exact(kf), innovation.nu.template cast<double>(),
                  innovation.s.dense().template cast<double>());
    }
  }
  return quality;
}

/// The Cramer-Rao bound of the last state: the Riccati recursion of the world's own matrices (Tichavsky, Muravchik,
/// Nehorai 1998 for the recursion of the information).
Eigen::Matrix4d cramer_rao_bound() {
  Eigen::Matrix4d f = Eigen::Matrix4d::Identity(), q = Eigen::Matrix4d::Zero();
  Eigen::Matrix<double, 2, 4> h = Eigen::Matrix<double, 2, 4>::Zero();
  for (int axis = 0; axis < 4; axis += 2) {
    f(axis, axis + 1) = 0.1;
    const Eigen::Vector2d g(0.005, 0.1);
    q.block<2, 2>(axis, axis) = kAcceleration * g * g.transpose();
    h(axis / 2, axis) = 1;
  }
  Eigen::Matrix4d information = Eigen::Vector4d(0.25, 1, 0.25, 1).asDiagonal();
  for (int k = 0; k < kSteps; ++k)
    information = (f * information.inverse() * f.transpose() + q).inverse() + h.transpose() * h / kPosition;
  return information.inverse();
}

template <class Filter>
class LinearQuality : public testing::Test {};
using Linear = testing::Types<filter::Ekf<Four>, filter::IteratedEkf<Four>, filter::JosephKalman<Four>,
                              filter::SequentialKalman<Four>, filter::UdKalman<Four>, filter::SquareRootKalman<Four>,
                              filter::StructuredKalman<Four>, filter::Ukf<Four>, filter::UkfSqrt<Four>>;
TYPED_TEST_SUITE(LinearQuality, Linear);

TYPED_TEST(LinearQuality, IsUnbiasedConsistentWhiteAndEfficient) {
  const auto quality = linear_quality<TypeParam>();
  EXPECT_TRUE(quality.unbiased()) << quality;
  EXPECT_TRUE(quality.nees_consistent()) << quality;
  EXPECT_TRUE(quality.nis_consistent()) << quality;
  EXPECT_TRUE(quality.white()) << quality;
  EXPECT_TRUE(quality.efficient(cramer_rao_bound())) << quality.final_error_over(cramer_rao_bound());
}

TYPED_TEST(LinearQuality, FailsWithQOrROffByThree) {
  for (const auto& [q, r] : {std::pair{3.0F, 1.0F}, {1 / 3.0F, 1.0F}, {1.0F, 3.0F}, {1.0F, 1 / 3.0F}}) {
    const auto quality = linear_quality<TypeParam>(q, r);
    EXPECT_FALSE(quality.consistent()) << "Q x " << q << ", R x " << r << ": " << quality;
    EXPECT_FALSE(quality.nees_consistent()) << "Q x " << q << ", R x " << r << ": " << quality;
    // A wrong Q hardly moves the mean of the NIS here; it colours the innovations.
    if (q > 2 || q < 0.5F) {
      EXPECT_FALSE(quality.white()) << "Q x " << q << ", R x " << r << ": " << quality;
    } else {
      EXPECT_FALSE(quality.nis_consistent()) << "Q x " << q << ", R x " << r << ": " << quality;
    }
  }
}

// An estimator that is no filter at all is not efficient: the last measurement and nothing of the past.
TEST(Quality, TheLastMeasurementAloneIsNotEfficient) {
  const Eigen::Matrix4d bound = cramer_rao_bound();
  test::Quality<2, 2> quality(1);
  Normal normal(7);
  const Eigen::Matrix2d r = kPosition * Eigen::Matrix2d::Identity();
  for (int run = 0; run < kSeeds; ++run) {
    quality.begin_run();
    const Eigen::Vector2d error(0.5 * normal(), 0.5 * normal());
    quality.add(0, error, r, error, r);
  }
  Eigen::Matrix2d of_position;
  of_position << bound(0, 0), bound(0, 2), bound(2, 0), bound(2, 2);
  EXPECT_FALSE(quality.efficient(of_position));
  EXPECT_GT(quality.final_error_over(of_position), 3.0);
}

TEST(Quality, QuantilesAreThoseOfTheTables) {
  EXPECT_NEAR(test::normal_quantile(0.975), 1.959964, 1e-6);
  EXPECT_NEAR(test::corrected_quantile(1), 2.575829, 1e-6);
  EXPECT_NEAR(test::corrected_quantile(100), 3.890592, 1e-6);
  const test::Interval one = test::corrected_mean_interval(400, 1, 1);
  EXPECT_NEAR(one.low, 330.903, 0.2);  // chi-square of 400 degrees at 0.5 % and 99.5 %
  EXPECT_NEAR(one.high, 476.606, 0.2);
}

// -- nonlinear: a robot with range and bearing to two landmarks
// ------------------------------------------------------------

template <class Filter>
test::Quality<3, 2> planar_quality(float q = 1, float r = 1) {
  const model::Landmark marks[] = {{base::Anchored{}.plus(6), base::Anchored{}.plus(2)},
                                   {base::Anchored{}.plus(-3), base::Anchored{}.plus(4)}};
  test::Quality<3, 2> quality(kSteps);
  for (unsigned seed = 0; seed < kSeeds; ++seed) {
    Normal normal(4000 + seed);
    Filter filter;
    set_covariance<Filter, 3>(filter, Symmetric<float, 3>::diagonal({0.01F, 0.01F, 0.0025F}));
    double x = 0.1 * normal(), y = 0.1 * normal(), yaw = 0.05 * normal();
    quality.begin_run();
    for (int k = 0; k < kSteps; ++k) {
      const model::PlanarIncrement increment{
          .ds_m = 0.08F, .dyaw_rad = 0.03F, .var_ds = q * 1e-3F, .var_dyaw = q * 5e-4F};
      const double ds = 0.08 + std::sqrt(1e-3) * normal(), dyaw = 0.03 + std::sqrt(5e-4) * normal();
      const double h = dyaw / 2, chord = std::abs(h) < 1e-9 ? ds : ds * std::sin(h) / h;
      x += chord * std::cos(yaw + h);
      y += chord * std::sin(yaw + h);
      yaw += dyaw;
      EXPECT_TRUE(filter.predict(increment));
      const model::Landmark& mark = marks[k % 2];
      const double dx = static_cast<double>(mark.x.minus({})) - x, dy = static_cast<double>(mark.y.minus({})) - y;
      const model::RangeBearing z{
          .range_m = static_cast<float>(std::hypot(dx, dy) + 0.1 * normal()),
          .bearing_rad = static_cast<float>(std::remainder(std::atan2(dy, dx) - yaw + 0.03 * normal(), 2 * M_PI)),
          .sigma_range_m = 0.1F * std::sqrt(r),
          .sigma_bearing_rad = 0.03F * std::sqrt(r),
          .landmark = mark};
      const auto innovation = filter.update(z, 1e9F);
      const Eigen::Vector3d error(static_cast<double>(filter.x.x.minus({})) - x,
                                  static_cast<double>(filter.x.y.minus({})) - y,
                                  std::remainder(static_cast<double>(filter.x.yaw_rad) - yaw, 2 * M_PI));
      quality.add(k, error, exact(filter), innovation.nu.template cast<double>(),
                  innovation.s.dense().template cast<double>());
    }
  }
  return quality;
}

template <class Filter>
class PlanarQuality : public testing::Test {};
using Pose = model::PlanarPose;
using Planar = testing::Types<filter::Ekf<Pose>, filter::IteratedEkf<Pose>, filter::UdKalman<Pose>,
                              filter::SquareRootKalman<Pose>, filter::Ukf<Pose>, filter::UkfSqrt<Pose>>;
TYPED_TEST_SUITE(PlanarQuality, Planar);

TYPED_TEST(PlanarQuality, IsUnbiasedConsistentAndWhite) {
  const auto quality = planar_quality<TypeParam>();
  EXPECT_TRUE(quality.unbiased()) << quality;
  EXPECT_TRUE(quality.nees_consistent()) << quality;
  EXPECT_TRUE(quality.nis_consistent()) << quality;
  EXPECT_TRUE(quality.white()) << quality;
}
TYPED_TEST(PlanarQuality, FailsWithQOrROffByThree) {
  for (const auto& [q, r] : {std::pair{3.0F, 1.0F}, {1 / 3.0F, 1.0F}, {1.0F, 3.0F}, {1.0F, 1 / 3.0F}})
    EXPECT_FALSE(planar_quality<TypeParam>(q, r).consistent()) << "Q x " << q << ", R x " << r;
}

// -- laws by name
// --------------------------------------------------------------------------------------------------------

// A constant seen n times: its error is sigma / sqrt(n), measured over 400 runs to 2 sigma of its own spread.
TYPED_TEST(LinearQuality, TheErrorOfAConstantFallsWithTheRootOfN) {
  constexpr int kRuns = 400;
  const int at[] = {1, 4, 16, 64, 256};
  double squares[5] = {};
  for (unsigned run = 0; run < kRuns; ++run) {
    Normal normal(5000 + run);
    TypeParam kf;
    set_covariance<TypeParam, 4>(kf, Symmetric<float, 4>::diagonal({1e6F, 1, 1e6F, 1}));
    int next = 0;
    for (int n = 1; n <= 256; ++n) {
      static_cast<void>(kf.update(
          filter::DirectMeasurement<float, 4, 0, 2>{
              .z = {static_cast<float>(5 + 2 * normal()), static_cast<float>(-3 + 2 * normal())}, .variance = {4, 4}},
          1e9F));
      if (n != at[next]) continue;
      squares[next] +=
          std::pow(static_cast<double>(kf.x.value(0)) - 5, 2) + std::pow(static_cast<double>(kf.x.value(2)) + 3, 2);
      ++next;
    }
  }
  for (int i = 0; i < 5; ++i)
    EXPECT_TRUE(test::corrected_mean_interval(1, 2 * kRuns, 5).has(squares[i] * at[i] / (4.0 * 2 * kRuns)))
        << "n = " << at[i] << ": " << squares[i] * at[i] / (4.0 * 2 * kRuns);
}

// R -> 0: the state becomes the measurement. P -> 0: it stays the prediction.
TYPED_TEST(LinearQuality, ASharpMeasurementWinsAndASharpPredictionWins) {
  const filter::DirectMeasurement<float, 4, 0, 2> sharp{.z = {7, -2}, .variance = {1e-8F, 1e-8F}};
  TypeParam kf;
  set_covariance<TypeParam, 4>(kf, Symmetric<float, 4>::diagonal({4, 1, 4, 1}));
  ASSERT_EQ(kf.update(sharp, 1e30F).verdict, filter::Verdict::kAccepted);
  EXPECT_NEAR(kf.x.value(0), 7, 1e-5);
  EXPECT_NEAR(kf.x.value(2), -2, 1e-5);
  EXPECT_LT(covariance(kf)(0, 0), 1.1e-6F) << "float keeps a variance of 2.4e-7 of the prior";

  const filter::DirectMeasurement<float, 4, 0, 2> ordinary{.z = {7, -2}, .variance = {1, 1}};
  TypeParam sure;
  set_covariance<TypeParam, 4>(sure, Symmetric<float, 4>::diagonal({1e-8F, 1e-8F, 1e-8F, 1e-8F}));
  ASSERT_EQ(sure.update(ordinary, 1e30F).verdict, filter::Verdict::kAccepted);
  EXPECT_LT(sure.x.value.norm(), 2e-7F);
  EXPECT_NEAR(covariance(sure)(0, 0), 1e-8F, 1e-14F);
}

// Bearings alone, from an observer that turns back every 30 s, to a target at 1000 m. The start has it at 300 m with a
// sigma of 1000 m (the classic case: Aidala 1979). Lost is beyond 200 m after 100 s.
template <class Filter>
int lost_targets() {
  int lost = 0;
  for (unsigned seed = 0; seed < 100; ++seed) {
    Normal normal(7000 + seed);
    constexpr double kSigma = 0.005, kRange = 300, kSigmaRange = 1000;
    double px = 0, py = 1000, observer = 0, worst = 0;
    const double bearing = M_PI / 2 + kSigma * normal();
    const Eigen::Vector2d along(std::cos(bearing), std::sin(bearing)), across(-along(1), along(0));
    const Eigen::Matrix2d position = kSigmaRange * kSigmaRange * along * along.transpose() +
                                     std::pow(kRange * kSigma, 2) * across * across.transpose();
    Filter filter;
    filter.x.value << static_cast<float>(kRange * along(0)), 0, static_cast<float>(kRange * along(1)), 0;
    auto p = Symmetric<float, 4>::diagonal({0, 100, 0, 100});
    p(0, 0) = static_cast<float>(position(0, 0));
    p(0, 2) = static_cast<float>(position(0, 1));
    p(2, 2) = static_cast<float>(position(1, 1));
    set_covariance<Filter, 4>(filter, p);
    for (int k = 0; k < 120; ++k) {
      px += 5, py -= 2, observer += k / 30 % 2 == 0 ? 10 : -10;
      EXPECT_TRUE(filter.predict(model::ConstantVelocity<float>{.dt_s = 1, .acceleration_variance = 1e-4F}));
      static_cast<void>(filter.update(model::TargetBearing<Four>{.bearing_rad = static_cast<float>(
                                                                     std::atan2(py, px - observer) + kSigma * normal()),
                                                                 .sigma_bearing_rad = static_cast<float>(kSigma),
                                                                 .sensor_x_m = static_cast<float>(observer)},
                                      1e9F));
      const double off =
          std::hypot(static_cast<double>(filter.x.value(0)) - px, static_cast<double>(filter.x.value(2)) - py);
      if (k > 100) worst = std::max(worst, off);
    }
    lost += worst < 200 ? 0 : 1;
  }
  return lost;
}
TEST(Divergence, AnExtendedFilterThatStartsWrongDivergesWhereAnUnscentedOneDoesNot) {
  EXPECT_GT(lost_targets<filter::Ekf<Four>>(), 50);
  EXPECT_EQ(lost_targets<filter::Ukf<Four>>(), 0);
  EXPECT_EQ(lost_targets<filter::UkfSqrt<Four>>(), 0);
}

}  // namespace
}  // namespace tetap
