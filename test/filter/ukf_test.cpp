// SPDX-License-Identifier: Apache-2.0
// Laws of both unscented filters: moments in closed form, angles, augmented noise, the choice of weights. The plain
// form breaks with a sharp sensor; the square-root form does not.
#include "tetap/filter/ukf.hpp"
#include "support/euler_pose.hpp"
#include "support/filter_covariance.hpp"
#include "support/never_nan.hpp"
#include "tetap/filter/ekf.hpp"
#include "tetap/filter/ukf_sqrt.hpp"
#include "tetap/model/ctrv.hpp"
#include "tetap/model/planar_increment.hpp"
#include "tetap/model/range_bearing.hpp"

#include <gtest/gtest.h>
#include <Eigen/Dense>
#include <cmath>
#include <random>

namespace tetap {
namespace {

using filter::Symmetric;
using filter::Vector;
using filter::VectorState;
using filter::Verdict;

/// Whether P is positive definite: of a square root by its diagonal, for no rounding of R^T R is to be judged.
template <class Filter>
bool positive(const Filter& filter) {
  if constexpr (requires { filter.root; }) {
    bool all = true;
    for (int i = 0; i < Filter::kErrors; ++i)
      all = all && filter.root(i, i) > 0 && std::isfinite(filter.root.covariance()(i, i));
    return all;
  } else {
    return test::least_eigenvalue(filter.p) > 0;
  }
}

struct Plain {
  template <class S, class Scaling = filter::UnitScaling>
  using Of = filter::Ukf<S, Scaling>;
};
struct Root {
  template <class S, class Scaling = filter::UnitScaling>
  using Of = filter::UkfSqrt<S, Scaling>;
};

template <class Form>
class Unscented : public testing::Test {};
using Forms = testing::Types<Plain, Root>;
TYPED_TEST_SUITE(Unscented, Forms);

// -- a heading that nobody knows -------------------------------------------------------------------------------------

/// A step of way_m ahead, next to no noise.
struct Ahead {
  float way_m = 0;
  model::PlanarPose predict(const model::PlanarPose& p) const {
    return {.x = p.x.plus(way_m * base::sincos(p.yaw_rad).cos),
            .y = p.y.plus(way_m * base::sincos(p.yaw_rad).sin),
            .yaw_rad = p.yaw_rad};
  }
  Symmetric<float, 3> noise(const model::PlanarPose&) const {
    return Symmetric<float, 3>::diagonal({1e-6F, 1e-6F, 1e-6F});
  }
};
constexpr float kSigmas[] = {0.1F, 0.5F, 1.0F, 1.5F, 1.8F, 1.82F, 1.9F, 2.2F, 2.62F, 3.1416F, 3.6276F, 5.0F, 10.0F};

TYPED_TEST(Unscented, IsNeverSurerOfAHeadingWithoutAMeasurement) {
  for (const float sigma : kSigmas)
    for (const float way_m : {0.0F, 0.1F, 3.0F}) {
      typename TypeParam::template Of<model::PlanarPose> kf;
      set_covariance(kf, Symmetric<float, 3>::diagonal({0.01F, 0.01F, sigma * sigma}));
      auto before = covariance(kf);
      for (int k = 0; k < 200; ++k) {
        ASSERT_TRUE(kf.predict(Ahead{way_m}));
        const auto after = covariance(kf);
        for (int i = 0; i < 3; ++i) ASSERT_GT(after(i, i), 0.9999F * before(i, i)) << sigma << " " << way_m << " " << k;
        before = after;
      }
      EXPECT_NEAR(before(2, 2), sigma * sigma + 200e-6F, 1e-3F * sigma * sigma) << sigma;
    }
}

TYPED_TEST(Unscented, AStepSpreadsAtLeastAsDrawnPathsDo) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  for (const float sigma : kSigmas)
    for (const float way_m : {0.1F, 1.0F, 8.0F})
      for (const float yaw : {0.0F, 0.8F, 2.9F}) {
        typename TypeParam::template Of<model::PlanarPose> kf;
        kf.x.yaw_rad = yaw;
        set_covariance(kf, Symmetric<float, 3>::diagonal({0.01F, 0.01F, sigma * sigma}));
        ASSERT_TRUE(kf.predict(Ahead{way_m}));
        Eigen::Matrix2d drawn = Eigen::Matrix2d::Zero();
        constexpr int kDraws = 20'000;
        for (int k = 0; k < kDraws; ++k) {
          const double at = static_cast<double>(yaw) + static_cast<double>(sigma) * normal(random);
          const Eigen::Vector2d e(
              0.1 * normal(random) + static_cast<double>(way_m) * std::cos(at) - static_cast<double>(kf.x.x.minus({})),
              0.1 * normal(random) + static_cast<double>(way_m) * std::sin(at) - static_cast<double>(kf.x.y.minus({})));
          drawn += e * e.transpose() / kDraws;
        }
        const auto p = covariance(kf);
        const Eigen::Matrix2d claimed = p.dense().template cast<double>().template topLeftCorner<2, 2>();
        const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::Matrix2d> ratio(claimed, drawn);
        EXPECT_GT(ratio.eigenvalues()(0), 0.9) << sigma << " " << way_m << " " << yaw;
        if (sigma <= 0.5F) {
          EXPECT_LT(ratio.eigenvalues()(1), 2.5) << sigma << " " << way_m << " " << yaw;
        }
      }
}

TYPED_TEST(Unscented, ATargetThatTurnsSpreadsAtLeastAsDrawnPathsDo) {
  std::mt19937 random(6);
  std::normal_distribution<double> normal;
  constexpr double kT = 0.5, kSigmaTurn = 0.3;
  for (const float sigma : kSigmas)
    for (const double speed : {1.0, 8.0})
      for (const double turn : {-1.0, 0.0, 1.0}) {
        typename TypeParam::template Of<model::CtrvState<float>> kf;
        kf.x.value << 0, 0, static_cast<float>(speed), 0.8F, static_cast<float>(turn);
        set_covariance(kf, Symmetric<float, 5>::diagonal({0.01F, 0.01F, 0.01F, sigma * sigma, 0.09F}));
        ASSERT_TRUE(kf.predict(model::Ctrv<float>{0.5F, 1e-4F, 1e-4F}));
        Eigen::Matrix2d drawn = Eigen::Matrix2d::Zero();
        constexpr int kDraws = 20'000;
        for (int k = 0; k < kDraws; ++k) {  // an arc between two headings
          const double v = speed + 0.1 * normal(random), w = turn + kSigmaTurn * normal(random);
          const double from = static_cast<double>(0.8F) + static_cast<double>(sigma) * normal(random),
                       to = from + w * kT;
          const Eigen::Vector2d e(
              0.1 * normal(random) + v / w * (std::sin(to) - std::sin(from)) - static_cast<double>(kf.x.value(0)),
              0.1 * normal(random) + v / w * (std::cos(from) - std::cos(to)) - static_cast<double>(kf.x.value(1)));
          drawn += e * e.transpose() / kDraws;
        }
        const Eigen::Matrix<double, 5, 5> p = covariance(kf).dense().template cast<double>();
        const Eigen::Matrix2d claimed = p.topLeftCorner<2, 2>();
        const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::Matrix2d> ratio(claimed, drawn);
        EXPECT_GT(ratio.eigenvalues()(0), 0.9) << sigma << " " << speed << " " << turn;
        const double yaw = static_cast<double>(sigma) * static_cast<double>(sigma) + kT * kT * kSigmaTurn * kSigmaTurn;
        EXPECT_NEAR(p(3, 3) / yaw, 1, 0.01) << sigma;
      }
}

TYPED_TEST(Unscented, OneSightingTurnsAHeadingThatNobodyKnowsTowardsTheTruth) {
  for (const float sigma : kSigmas)
    for (const float truth : {0.3F, 1.0F, 2.0F, -2.5F, 3.1F}) {
      typename TypeParam::template Of<model::PlanarPose> kf;
      set_covariance(kf, Symmetric<float, 3>::diagonal({0.01F, 0.01F, sigma * sigma}));
      if (sigma < 1.5F) continue;
      const model::RangeBearing z{.range_m = 5,
                                  .bearing_rad = base::wrap_angle(0.7F - truth),
                                  .sigma_range_m = 0.1F,
                                  .sigma_bearing_rad = 0.05F,
                                  .landmark = {.x = base::Anchored{}.plus(5 * base::sincos(0.7F).cos),
                                               .y = base::Anchored{}.plus(5 * base::sincos(0.7F).sin)}};
      ASSERT_EQ(kf.update(z, 1e9F).verdict, Verdict::kAccepted);
      const float error = base::wrap_angle(kf.x.yaw_rad - truth), sigma_now = std::sqrt(covariance(kf)(2, 2));
      EXPECT_LT(std::abs(error), 3 * sigma_now) << sigma << " " << truth;
      EXPECT_LT(sigma_now, 0.2F);
    }
}

// -- moments --------------------------------------------------------------------------------------------------------

/// z = x^2 of x ~ N(m, s^2): mean m^2 + s^2, variance 4 m^2 s^2 + 2 s^4, covariance with x 2 m s^2.
struct Square {
  static constexpr int kDimension = 1;
  static constexpr std::array<int, 1> kTouches{0};
  double z = 0;
  double variance = 0.25;
  [[nodiscard]] Vector<double, 1> predict(const VectorState<double, 1>& x) const {
    return Vector<double, 1>{x.value(0) * x.value(0)};
  }
  [[nodiscard]] Vector<double, 1> residual(const Vector<double, 1>& z_hat) const {
    return Vector<double, 1>{z - z_hat(0)};
  }
  [[nodiscard]] Vector<double, 1> noise() const { return Vector<double, 1>{variance}; }
};

TYPED_TEST(Unscented, MeanAndVarianceOfASquareAreThoseOfAGaussian) {
  for (const double m : {0.0, 1.5, -4.0})
    for (const double s2 : {0.04, 1.0, 9.0}) {
      typename TypeParam::template Of<VectorState<double, 1>> ukf;
      ukf.x.value(0) = m;
      set_covariance<decltype(ukf), 1>(ukf, Symmetric<double, 1>::diagonal({s2}));
      const Square z{.z = 2.0};
      const auto innovation = ukf.update(z, 1e9);
      ASSERT_EQ(innovation.verdict, Verdict::kAccepted);
      const double s = 4 * m * m * s2 + 2 * s2 * s2 + 0.25;
      EXPECT_NEAR(innovation.nu(0), 2.0 - (m * m + s2), 1e-12 * (1 + m * m + s2));
      EXPECT_NEAR(innovation.s(0, 0), s, 1e-12 * s);
      const double gain = 2 * m * s2 / s;
      EXPECT_NEAR(ukf.x.value(0), m + gain * innovation.nu(0), 1e-12 * (1 + std::abs(m)));
      EXPECT_NEAR(covariance(ukf)(0, 0), s2 - gain * gain * s, 1e-12 * s2);
    }
}

/// x+ = A x + b, seen through a model that has no Jacobian.
struct Affine {
  filter::Matrix<double, 3, 3> a;
  Vector<double, 3> b;
  [[nodiscard]] VectorState<double, 3> predict(const VectorState<double, 3>& x) const { return {a * x.value + b}; }
  [[nodiscard]] Symmetric<double, 3> noise(const VectorState<double, 3>&) const { return {}; }
};

TYPED_TEST(Unscented, TheAffineImageOfAGaussianIsExact) {
  std::mt19937 random(31);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 200; ++i) {
    Affine motion;
    filter::Matrix<double, 3, 3> root;
    for (int k = 0; k < 9; ++k) motion.a(k / 3, k % 3) = normal(random), root(k / 3, k % 3) = normal(random);
    for (int k = 0; k < 3; ++k) motion.b(k) = 100 * normal(random);
    typename TypeParam::template Of<VectorState<double, 3>> ukf;
    ukf.x.value = {normal(random), normal(random), normal(random)};
    const Eigen::Matrix3d p = root * root.transpose() + 0.01 * Eigen::Matrix3d::Identity();
    set_covariance<decltype(ukf), 3>(ukf, Symmetric<double, 3>::upper_of(p));
    const Eigen::Vector3d mean = motion.a * ukf.x.value + motion.b;
    const Eigen::Matrix3d image = motion.a * p * motion.a.transpose();
    if (Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(image).eigenvalues()(0) < 1e-4 * image.trace()) continue;
    ASSERT_TRUE(ukf.predict(motion));
    EXPECT_LT((ukf.x.value - mean).norm(), 1e-12 * mean.norm());
    EXPECT_LT((covariance(ukf).dense() - image).norm(), 1e-11 * image.norm());
  }
}

/// x+ = (x0 + w0^2, x1 + w1): w0 shifts the mean by its variance q, and adds 2 q^2.
struct SquaredNoise {
  static constexpr int kNoises = 2;
  Vector<double, 2> variance;
  [[nodiscard]] VectorState<double, 2> predict(const VectorState<double, 2>& x, const Vector<double, 2>& w) const {
    return {{x.value(0) + w(0) * w(0), x.value(1) + w(1)}};
  }
  [[nodiscard]] Vector<double, 2> noise() const { return variance; }
};
/// z = x0 + v^2.
struct SquaredMeasurementNoise {
  static constexpr int kDimension = 1;
  static constexpr int kNoises = 1;
  static constexpr std::array<int, 1> kTouches{0};
  double z = 0;
  double variance = 1;
  [[nodiscard]] Vector<double, 1> predict(const VectorState<double, 2>& x, const Vector<double, 1>& v) const {
    return Vector<double, 1>{x.value(0) + v(0) * v(0)};
  }
  [[nodiscard]] Vector<double, 1> residual(const Vector<double, 1>& z_hat) const {
    return Vector<double, 1>{z - z_hat(0)};
  }
  [[nodiscard]] Vector<double, 1> noise() const { return Vector<double, 1>{variance}; }
};

TYPED_TEST(Unscented, AugmentedNoiseEntersAsItsSquare) {
  typename TypeParam::template Of<VectorState<double, 2>> ukf;
  ukf.x.value = {1.0, -2.0};
  set_covariance<decltype(ukf), 2>(ukf, Symmetric<double, 2>::diagonal({0.5, 0.3}));
  ASSERT_TRUE(ukf.predict(SquaredNoise{.variance = {0.2, 0.4}}));
  EXPECT_NEAR(ukf.x.value(0), 1.2, 1e-14);
  EXPECT_NEAR(ukf.x.value(1), -2.0, 1e-14);
  // Four dimensions put the points at 2 sigma, so the fourth moment counts as 4 where a Gaussian's is 3. The variance
  // of the square is (4 - 1) q^2 plus (beta - alpha^2) q^2.
  EXPECT_NEAR(covariance(ukf)(0, 0), 0.5 + 4 * 0.04 + 0.04, 1e-13);
  EXPECT_NEAR(covariance(ukf)(1, 1), 0.3 + 0.4, 1e-14);
  const double before = covariance(ukf)(0, 0);
  const auto innovation = ukf.update(SquaredMeasurementNoise{.z = 3.0, .variance = 0.1}, 1e9);
  ASSERT_EQ(innovation.verdict, Verdict::kAccepted);
  EXPECT_NEAR(innovation.nu(0), 3.0 - 1.2 - 0.1, 1e-14);
  EXPECT_NEAR(innovation.s(0, 0), before + 3 * 0.01 + 0.01, 1e-13);
}

// -- angles -----------------------------------------------------------------------------------------------------------

model::Landmark at(float x_m, float y_m) { return {.x = base::Anchored{}.plus(x_m), .y = base::Anchored{}.plus(y_m)}; }
const model::Landmark kMarks[] = {at(60, 20), at(-30, 40)};

/// A robot that drives circles among two landmarks, for as long as wanted.
struct Drive {
  double x = 0, y = 0, yaw = 0;
  model::PlanarIncrement increment;
  model::RangeBearing sight;

  void step(int k, double sigma_range_m, double sigma_bearing_rad, const auto& normal) {
    const double turn = 0.02 + 0.03 * std::cos(0.05 * k);
    increment = {.ds_m = 0.1F, .dyaw_rad = static_cast<float>(turn), .var_ds = 1e-3F, .var_dyaw = 1e-4F};
    const double ds = 0.1 + std::sqrt(1e-3) * normal(), dyaw = turn + 1e-2 * normal();
    const double h = dyaw / 2, chord = std::abs(h) < 1e-9 ? ds : ds * std::sin(h) / h;
    x += chord * std::cos(yaw + h);
    y += chord * std::sin(yaw + h);
    yaw = std::remainder(yaw + dyaw, 2 * M_PI);
    const model::Landmark& mark = kMarks[k % 2];
    const double dx = static_cast<double>(mark.x.minus({})) - x, dy = static_cast<double>(mark.y.minus({})) - y;
    sight = {.range_m = static_cast<float>(std::hypot(dx, dy) + sigma_range_m * normal()),
             .bearing_rad =
                 static_cast<float>(std::remainder(std::atan2(dy, dx) - yaw + sigma_bearing_rad * normal(), 2 * M_PI)),
             .sigma_range_m = static_cast<float>(sigma_range_m),
             .sigma_bearing_rad = static_cast<float>(sigma_bearing_rad),
             .landmark = mark};
  }
  [[nodiscard]] Eigen::Vector3d error(const model::PlanarPose& of) const {
    return {static_cast<double>(of.x.minus({})) - x, static_cast<double>(of.y.minus({})) - y,
            std::remainder(static_cast<double>(of.yaw_rad) - yaw, 2 * M_PI)};
  }
};

struct Tally {
  double nees = 0, nis = 0, worst_m = 0;
  int steps = 0, refused = 0;
};
template <class Filter>
Tally drive(Filter filter, int steps, double sigma_range_m, double sigma_bearing_rad) {
  set_covariance<Filter, 3>(filter, Symmetric<float, 3>::diagonal({0.01F, 0.01F, 0.01F}));
  std::mt19937 random(32);
  std::normal_distribution<double> gauss;
  const auto normal = [&] { return gauss(random); };
  Drive world;
  world.x = 0.1 * normal(), world.y = 0.1 * normal(), world.yaw = 0.1 * normal();
  Tally tally{.steps = steps};
  for (int k = 0; k < steps; ++k) {
    world.step(k, sigma_range_m, sigma_bearing_rad, normal);
    const bool predicted = filter.predict(world.increment);
    const auto innovation = filter.update(world.sight, 1e9F);
    if (!predicted || innovation.verdict != Verdict::kAccepted) ++tally.refused;
    const Eigen::Vector3d e = world.error(filter.x);
    const Eigen::LLT<Eigen::Matrix3d> factor(covariance(filter).dense().template cast<double>().eval());
    if (factor.info() != Eigen::Success) ++tally.refused;
    tally.nees += e.dot(factor.solve(e)) / steps;
    tally.nis += static_cast<double>(innovation.nis) / steps;
    if (k >= 10) tally.worst_m = std::max(tally.worst_m, e.head<2>().norm());
  }
  return tally;
}

TYPED_TEST(Unscented, BearingsThatCrossHalfATurnAreNeverAveraged) {
  // On the circle both landmarks are behind the robot again and again.
  const Tally tally = drive(typename TypeParam::template Of<model::PlanarPose>{}, 20000, 0.1, 0.02);
  EXPECT_EQ(tally.refused, 0);
  EXPECT_NEAR(tally.nis, 2.0, 0.06);
  EXPECT_NEAR(tally.nees, 3.0, 0.25);
  EXPECT_LT(tally.worst_m, 2.0);
}

TYPED_TEST(Unscented, ALandmarkRightBehindIsSeenAsSharplyAsOneAhead) {
  typename TypeParam::template Of<model::PlanarPose> ukf;
  set_covariance<decltype(ukf), 3>(ukf, Symmetric<float, 3>::diagonal({0.01F, 0.01F, 0.01F}));
  model::RangeBearing z{.range_m = 10, .sigma_range_m = 0.1F, .sigma_bearing_rad = 0.02F, .landmark = at(10, 0)};
  const auto ahead = ukf.update(z, -1.0F).s;
  z.landmark = at(-10, 0);  // points on both sides of half a turn
  z.bearing_rad = 3.14159F;
  const auto behind = ukf.update(z, -1.0F);
  EXPECT_NEAR(behind.s(1, 1), ahead(1, 1), 1e-5F);
  EXPECT_NEAR(behind.nu(1), 0.0F, 1e-3F);
}

TYPED_TEST(Unscented, AResidualNearHalfATurnDoesNotWidenS) {
  typename TypeParam::template Of<model::PlanarPose> ukf;
  set_covariance<decltype(ukf), 3>(ukf, Symmetric<float, 3>::diagonal({0.01F, 0.01F, 0.01F}));
  model::RangeBearing z{.range_m = 10, .sigma_range_m = 0.1F, .sigma_bearing_rad = 0.02F, .landmark = at(10, 0)};
  const auto ahead = ukf.update(z, 0.0F).s;
  z.bearing_rad = 3.14159F;  // half a turn off: points on both sides
  const auto behind = ukf.update(z, 0.0F);
  EXPECT_EQ(behind.verdict, Verdict::kRejected);
  EXPECT_EQ(behind.s.packed(), ahead.packed());
  EXPECT_GT(behind.nis, 500.0F);
}

// -- weights ----------------------------------------------------------------------------------------------------------

using filter::RuntimeScaling;
using filter::ScalingVerdict;

static_assert(filter::judge_scaling(filter::UnitScaling{}, 3, false) == ScalingVerdict::kUsable);
static_assert(filter::judge_scaling(RuntimeScaling{.kAlpha = 0.1F}, 3, false) == ScalingVerdict::kUsable);
static_assert(filter::judge_scaling(RuntimeScaling{.kAlpha = 0.0999F}, 3, false) ==
              ScalingVerdict::kAlphaNeedsSquareRoot);
static_assert(filter::judge_scaling(RuntimeScaling{.kAlpha = 0.01F}, 3, true) == ScalingVerdict::kUsable);
static_assert(filter::judge_scaling(RuntimeScaling{.kAlpha = 1.5F}, 3, true) == ScalingVerdict::kBetaBelowAlpha2);
static_assert(filter::judge_scaling(RuntimeScaling{.kKappa = -3}, 3, true) == ScalingVerdict::kSpreadNotPositive);
static_assert(filter::judge_scaling(RuntimeScaling{.kBeta = base::kNan}, 3, true) == ScalingVerdict::kBetaBelowAlpha2);

TEST(Scaling, ThePlainFormRefusesASmallAlphaAndKeepsWhatItHas) {
  filter::Ukf<model::PlanarPose, RuntimeScaling> asked;
  filter::Ukf<model::PlanarPose> plain;
  EXPECT_EQ(asked.set_scaling({.kAlpha = 0.05F}), ScalingVerdict::kAlphaNeedsSquareRoot);
  EXPECT_EQ(asked.set_scaling({.kAlpha = base::kNan}), ScalingVerdict::kSpreadNotPositive);
  asked.p = plain.p = Symmetric<float, 3>::diagonal({0.1F, 0.2F, 0.01F});
  const model::PlanarIncrement increment{.ds_m = 1, .dyaw_rad = 0.3F, .var_ds = 0.01F, .var_dyaw = 0.01F};
  ASSERT_TRUE(asked.predict(increment));
  ASSERT_TRUE(plain.predict(increment));
  EXPECT_EQ(asked.p.packed(), plain.p.packed());
  ASSERT_EQ(asked.set_scaling({.kAlpha = 0.5F}), ScalingVerdict::kUsable);
  ASSERT_TRUE(asked.predict(increment));
  ASSERT_TRUE(plain.predict(increment));
  EXPECT_NE(asked.p.packed(), plain.p.packed());
  filter::UkfSqrt<model::PlanarPose, RuntimeScaling> root;
  EXPECT_EQ(root.set_scaling({.kAlpha = 0.05F}), ScalingVerdict::kUsable);
}

/// The textbook's plain form in float, weights as printed (Thrun, Burgard, Fox 2005, table 3.4), on the same drive. The
/// result is the steps until P has no Cholesky factor; -1 when it keeps one.
int textbook_breaks_after(double alpha, double sigma_range_m, double sigma_bearing_rad, int steps) {
  using Eigen::Matrix3f, Eigen::Vector3f, Eigen::Vector2f;
  std::mt19937 random(32);
  std::normal_distribution<double> gauss;
  const auto normal = [&] { return gauss(random); };
  const double lambda = alpha * alpha * 3 - 3;
  const auto mean0 = static_cast<float>(lambda / (3 + lambda));
  const auto covariance0 = static_cast<float>(lambda / (3 + lambda) + 1 - alpha * alpha + 2);
  const auto each = static_cast<float>(0.5 / (3 + lambda)), spread = static_cast<float>(std::sqrt(3 + lambda));
  Drive world;
  Vector3f x = Vector3f::Zero();
  Matrix3f p = Vector3f(0.01F, 0.01F, 0.01F).asDiagonal();
  Eigen::Matrix<float, 3, 7> points;
  const auto draw = [&] {
    const Eigen::LLT<Matrix3f> factor(p);
    if (factor.info() != Eigen::Success || !p.allFinite()) return false;
    const Matrix3f l = factor.matrixL();
    for (int i = 0; i < 7; ++i) points.col(i) = x;
    for (int i = 0; i < 3; ++i) points.col(1 + i) += spread * l.col(i), points.col(4 + i) -= spread * l.col(i);
    return true;
  };
  for (int k = 0; k < steps; ++k) {
    world.step(k, sigma_range_m, sigma_bearing_rad, normal);
    if (!draw()) return k;
    for (int i = 0; i < 7; ++i) {
      const float yaw = points(2, i) + 0.5F * world.increment.dyaw_rad;
      points(0, i) += world.increment.ds_m * std::cos(yaw);
      points(1, i) += world.increment.ds_m * std::sin(yaw);
      points(2, i) += world.increment.dyaw_rad;
    }
    x = mean0 * points.col(0) + each * points.rightCols<6>().rowwise().sum();
    p = Vector3f(1e-3F, 1e-3F, 1e-4F).asDiagonal();
    for (int i = 0; i < 7; ++i)
      p += (i == 0 ? covariance0 : each) * (points.col(i) - x) * (points.col(i) - x).transpose();
    if (!draw()) return k;
    Eigen::Matrix<float, 2, 7> z;
    for (int i = 0; i < 7; ++i) {
      const float dx = world.sight.landmark.x.minus({}) - points(0, i),
                  dy = world.sight.landmark.y.minus({}) - points(1, i);
      z.col(i) = Vector2f(std::hypot(dx, dy), std::atan2(dy, dx) - points(2, i));
    }
    for (int i = 1; i < 7; ++i) z(1, i) = z(1, 0) + std::remainder(z(1, i) - z(1, 0), static_cast<float>(2 * M_PI));
    const Vector2f mean = mean0 * z.col(0) + each * z.rightCols<6>().rowwise().sum();
    Eigen::Matrix2f s = Vector2f(world.sight.sigma_range_m, world.sight.sigma_bearing_rad).cwiseAbs2().asDiagonal();
    Eigen::Matrix<float, 3, 2> cross = Eigen::Matrix<float, 3, 2>::Zero();
    for (int i = 0; i < 7; ++i) {
      s += (i == 0 ? covariance0 : each) * (z.col(i) - mean) * (z.col(i) - mean).transpose();
      cross += (i == 0 ? covariance0 : each) * (points.col(i) - x) * (z.col(i) - mean).transpose();
    }
    const Eigen::Matrix<float, 3, 2> gain = cross * s.inverse();
    Vector2f nu(world.sight.range_m - mean(0), 0.0F);
    nu(1) = std::remainder(world.sight.bearing_rad - mean(1), static_cast<float>(2 * M_PI));
    x += gain * nu;
    p -= gain * s * gain.transpose();
  }
  return -1;
}

struct SmallAlpha {
  static constexpr float kAlpha = 0.01F, kBeta = 2, kKappa = 0;
};

// 1 mm and 0.1 mrad: the plain textbook form loses its covariance at once with alpha 0.01 and keeps it with alpha 1 and
// an ordinary sensor. The square-root form holds for 10^6 steps, and its error stays within its covariance.
TEST(Scaling, ASharpSensorBreaksThePlainTextbookFormWithASmallAlpha) {
  const int steps = textbook_breaks_after(0.01, 1e-3, 1e-4, 2000);
  EXPECT_GE(steps, 0);
  EXPECT_LT(steps, 20);
  EXPECT_EQ(textbook_breaks_after(1.0, 0.1, 0.02, 2000), -1);
}

TEST(Scaling, TheSquareRootFormHoldsTheSharpSensorForAMillionSteps) {
  const Tally tally = drive(filter::UkfSqrt<model::PlanarPose, SmallAlpha>{}, 1'000'000, 1e-3, 1e-4);
  EXPECT_EQ(tally.refused, 0);
  EXPECT_GT(tally.nees, 2.0);
  EXPECT_LT(tally.nees, 4.0);
  // Differences of points 0.017 sigma away weigh 1667 each: their rounding is what the error is made of.
  EXPECT_LT(tally.worst_m, 0.5);
}

TEST(Scaling, ThePlainFormHoldsTheSharpSensorWithTheUsualWeights) {
  const Tally tally = drive(filter::Ukf<model::PlanarPose>{}, 100'000, 1e-3, 1e-4);
  EXPECT_EQ(tally.refused, 0);
  EXPECT_GT(tally.nees, 2.5);
  EXPECT_LT(tally.nees, 4.0);
  EXPECT_LT(tally.worst_m, 0.2);
}

// -- hostile input
// ------------------------------------------------------------------------------------------------------

test::Fields fields_of(model::RangeBearing& m) {
  return {&m.range_m,           &m.bearing_rad,         &m.sigma_range_m,
          &m.sigma_bearing_rad, &m.landmark.x.offset_m, &m.landmark.y.offset_m,
          &m.mounting.x_b_m,    &m.mounting.y_b_m,      &m.mounting.yaw_rad};
}
test::Fields fields_of(model::PlanarIncrement& m) {
  return {&m.ds_m, &m.dyaw_rad, &m.var_ds, &m.cov_ds_dyaw, &m.var_dyaw};
}
bool same(const model::PlanarPose& a, const model::PlanarPose& b) {
  return a.x.um() == b.x.um() && a.y.um() == b.y.um() && base::bits(a.yaw_rad) == base::bits(b.yaw_rad);
}

TYPED_TEST(Unscented, WhateverIsMeasuredTheStateStaysANumberAndPPositive) {
  typename TypeParam::template Of<model::PlanarPose> well;
  set_covariance<decltype(well), 3>(well, Symmetric<float, 3>::diagonal({0.1F, 0.1F, 0.05F}));
  model::RangeBearing good{.sigma_range_m = 0.1F,
                           .sigma_bearing_rad = 0.02F,
                           .landmark = at(5, 2),
                           .mounting = {.x_b_m = 0.2F, .y_b_m = -0.1F, .yaw_rad = 0.3F}};
  const auto z = good.predict(well.x);
  good.range_m = z(0), good.bearing_rad = z(1);
  for (std::size_t field = 0; field < 9; ++field)
    for (const float value : test::kHostile) {
      model::RangeBearing bad = good;
      *fields_of(bad)[field] = value;
      auto ukf = well;
      const auto record = ukf.update(bad, 1e9F);
      SCOPED_TRACE(testing::Message() << "field " << field << " = " << value);
      if (!base::is_finite(value)) {
        EXPECT_EQ(record.verdict, Verdict::kNotFinite);
      }
      if (record.verdict != Verdict::kAccepted) {
        EXPECT_TRUE(same(ukf.x, well.x));
        EXPECT_EQ(covariance(ukf).packed(), covariance(well).packed());
      }
      EXPECT_TRUE(ukf.x.finite());
      EXPECT_TRUE(positive(ukf));
    }
}

TYPED_TEST(Unscented, AMotionThatIsNoneIsRefusedAndChangesNothing) {
  typename TypeParam::template Of<model::PlanarPose> well;
  set_covariance<decltype(well), 3>(well, Symmetric<float, 3>::diagonal({0.1F, 0.1F, 0.05F}));
  const model::PlanarIncrement good{
      .ds_m = 0.1F, .dyaw_rad = 0.02F, .var_ds = 1e-3F, .cov_ds_dyaw = 1e-5F, .var_dyaw = 1e-3F};
  for (std::size_t field = 0; field < 5; ++field)
    for (const float value : test::kHostile) {
      model::PlanarIncrement bad = good;
      *fields_of(bad)[field] = value;
      auto ukf = well;
      SCOPED_TRACE(testing::Message() << "field " << field << " = " << value);
      if (!ukf.predict(bad)) {
        EXPECT_TRUE(same(ukf.x, well.x));
        EXPECT_EQ(covariance(ukf).packed(), covariance(well).packed());
      } else {
        EXPECT_TRUE(base::is_finite(value));
      }
      EXPECT_TRUE(ukf.x.finite());
      EXPECT_TRUE(positive(ukf));
    }
}

}  // namespace
}  // namespace tetap
