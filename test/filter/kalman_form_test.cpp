// SPDX-License-Identifier: Apache-2.0
// Laws of every form of the Kalman filter, each named in a list. The judges are the worked example and a dense
// reference over matrices that change at every step. A refusal leaves state and covariance alone.
#include "filter/kalman_forms.hpp"
#include "support/filter_covariance.hpp"
#include "support/least_eigenvalue.hpp"
#include "tetap/filter/linear_models.hpp"
#include "tetap/model/target_range.hpp"

#include <gtest/gtest.h>
#include <Eigen/Dense>
#include <cmath>
#include <limits>
#include <random>

namespace tetap {
namespace {

using filter::Symmetric;
using filter::Vector;
using filter::VectorState;
using filter::Verdict;

template <class Form>
class KalmanForm : public testing::Test {};
TYPED_TEST_SUITE(KalmanForm, test::Forms);

// Position and velocity, 0.1 s, Q = 0.001 I, R = 0.5, P0 = 10 I, z = 0.5.
template <class Filter>
void worked_example() {
  using Scalar = typename Filter::Scalar;
  Filter kf;
  set_covariance<Filter, 2>(kf, Symmetric<Scalar, 2>::diagonal({10, 10}));
  filter::ControlledMotion<Scalar, 2, 1> motion;
  motion.f(0, 1) = Scalar(0.1F);
  motion.q = Symmetric<Scalar, 2>::diagonal({Scalar(0.001F), Scalar(0.001F)});
  ASSERT_TRUE(kf.predict(motion));
  const auto prior = covariance(kf);
  EXPECT_NEAR(prior(0, 0), 10.101, 2e-5);
  EXPECT_NEAR(prior(0, 1), 1.0, 2e-6);
  EXPECT_NEAR(prior(1, 1), 10.001, 2e-5);
  const filter::DirectMeasurement<Scalar, 2, 0> z{.z = Vector<Scalar, 1>(Scalar(0.5F)),
                                                  .variance = Vector<Scalar, 1>(Scalar(0.5F))};
  const auto innovation = kf.update(z, Scalar{9});
  ASSERT_EQ(innovation.verdict, Verdict::kAccepted);
  EXPECT_NEAR(innovation.s(0, 0), 10.601, 2e-5);
  EXPECT_NEAR(innovation.nis, 0.25 / 10.601, 1e-6);
  EXPECT_NEAR(kf.x.value(0), 0.47642, 1e-5);
  EXPECT_NEAR(kf.x.value(1), 0.04717, 1e-5);
  EXPECT_NEAR(kf.x.value(0) / Scalar(0.5F), 0.95283, 1e-5) << "gain of position";
  EXPECT_NEAR(kf.x.value(1) / Scalar(0.5F), 0.09433, 1e-5) << "gain of velocity";
}
TYPED_TEST(KalmanForm, WorkedExampleInFloat) {
  worked_example<typename TypeParam::template Of<VectorState<float, 2>>>();
}
TYPED_TEST(KalmanForm, WorkedExampleInDouble) {
  worked_example<typename TypeParam::template Of<VectorState<double, 2>>>();
}

/// The textbook in double: P = F P F' + Q; K = P H' S^-1, P = (I - K H) P (I - K H)' + K R K'.
struct Reference {
  Eigen::Vector3d x = Eigen::Vector3d::Zero();
  Eigen::Matrix3d p = Eigen::Matrix3d::Identity();

  void predict(const Eigen::Matrix3d& f, const Eigen::Matrix<double, 3, 2>& b, const Eigen::Vector2d& u,
               const Eigen::Matrix3d& q) {
    x = (f * x + b * u).eval();
    p = (f * p * f.transpose() + q).eval();
  }
  double update(const Eigen::Matrix<double, 2, 3>& h, const Eigen::Vector2d& z, const Eigen::Matrix2d& r) {
    const Eigen::Matrix2d s = h * p * h.transpose() + r;
    const Eigen::Matrix<double, 3, 2> k = p * h.transpose() * s.inverse();
    const Eigen::Vector2d nu = z - h * x;
    x += k * nu;
    const Eigen::Matrix3d left = Eigen::Matrix3d::Identity() - k * h;
    p = (left * p * left.transpose() + k * r * k.transpose()).eval();
    return nu.dot(s.inverse() * nu);
  }
};

/// F, B, u, H, Q and a full R drawn anew at each of 300 steps.
template <class Filter>
void changing_matrices(double tolerance) {
  using Scalar = typename Filter::Scalar;
  std::mt19937 random(21);
  std::normal_distribution<double> normal;
  const auto fill = [&](auto& m, double scale) {
    for (int i = 0; i < m.size(); ++i) m.data()[i] = static_cast<double>(static_cast<float>(scale * normal(random)));
  };
  Filter kf;
  set_covariance<Filter, 3>(kf, Symmetric<Scalar, 3>::diagonal({1, 1, 1}));
  Reference reference;
  for (int k = 0; k < 300; ++k) {
    Eigen::Matrix3d f, root;
    Eigen::Matrix<double, 3, 2> b;
    Eigen::Vector2d u, z;
    Eigen::Matrix<double, 2, 3> h;
    Eigen::Matrix2d noise;
    fill(f, 0.2), fill(root, 0.3), fill(b, 1), fill(u, 1), fill(z, 1), fill(h, 1), fill(noise, 0.5);
    f += 0.8 * Eigen::Matrix3d::Identity();
    const Eigen::Matrix3d q =
        (root * root.transpose() + 0.01 * Eigen::Matrix3d::Identity()).cast<Scalar>().template cast<double>();
    const Eigen::Matrix2d r =
        (noise * noise.transpose() + 0.1 * Eigen::Matrix2d::Identity()).cast<Scalar>().template cast<double>();
    f = f.cast<Scalar>().template cast<double>().eval();
    const filter::ControlledMotion<Scalar, 3, 2> motion{.f = f.cast<Scalar>(),
                                                        .b = b.cast<Scalar>(),
                                                        .u = u.cast<Scalar>(),
                                                        .q = Symmetric<Scalar, 3>::upper_of(q.cast<Scalar>())};
    ASSERT_TRUE(kf.predict(motion));
    reference.predict(f, b, u, q);
    const auto innovation =
        kf.update(filter::independent_components<Scalar, 3, 2>(h.cast<Scalar>(), z.cast<Scalar>(),
                                                               Symmetric<Scalar, 2>::upper_of(r.cast<Scalar>())),
                  Scalar(1e9F));
    ASSERT_EQ(innovation.verdict, Verdict::kAccepted);
    const double nis = reference.update(h, z, r);
    EXPECT_NEAR(static_cast<double>(innovation.nis), nis, 20 * tolerance * (1 + nis));
    const Eigen::Matrix3d p = covariance(kf).dense().template cast<double>();
    for (int i = 0; i < 3; ++i) {
      const double sigma = std::sqrt(reference.p(i, i));
      EXPECT_NEAR(static_cast<double>(kf.x.value(i)), reference.x(i),
                  10 * tolerance * (sigma + std::abs(reference.x(i))));
      for (int j = 0; j < 3; ++j)
        EXPECT_NEAR(p(i, j), reference.p(i, j), tolerance * sigma * std::sqrt(reference.p(j, j)));
    }
  }
}
TYPED_TEST(KalmanForm, EqualsTheTextbookWithMatricesThatChangeAtEveryStepInFloat) {
  changing_matrices<typename TypeParam::template Of<VectorState<float, 3>>>(2e-5);
}
TYPED_TEST(KalmanForm, EqualsTheTextbookWithMatricesThatChangeAtEveryStepInDouble) {
  changing_matrices<typename TypeParam::template Of<VectorState<double, 3>>>(1e-12);
}

using Pair = filter::DirectMeasurement<float, 3, 0, 2>;

template <class Filter>
Filter rolling() {
  Filter kf;
  set_covariance<Filter, 3>(kf, Symmetric<float, 3>::diagonal({1.0F, 2.0F, 3.0F}));
  filter::LinearMotion<float, 3> motion;
  motion.f(0, 1) = motion.f(1, 2) = 0.5F;
  motion.q = Symmetric<float, 3>::diagonal({0.1F, 0.1F, 0.1F});
  EXPECT_TRUE(kf.predict(motion));
  return kf;
}

TYPED_TEST(KalmanForm, AMeasurementBeyondTheGateChangesNothing) {
  using Filter = typename TypeParam::template Of<VectorState<float, 3>>;
  auto kf = rolling<Filter>();
  const auto before = covariance(kf).packed();
  const auto innovation = kf.update(Pair{.z = {20.0F, 0.0F}, .variance = {1.0F, 1.0F}}, 9.21F);
  EXPECT_EQ(innovation.verdict, Verdict::kRejected);
  EXPECT_GT(innovation.nis, 9.21F);
  EXPECT_EQ(kf.x.value, (Vector<float, 3>::Zero()));
  EXPECT_EQ(covariance(kf).packed(), before);
}

TYPED_TEST(KalmanForm, WhatIsNoNumberIsRefusedAndChangesNothing) {
  using Filter = typename TypeParam::template Of<VectorState<float, 3>>;
  const auto well = rolling<Filter>();
  for (const float bad : {base::kNan, base::kInfinity, -base::kInfinity})
    for (int field = 0; field < 4; ++field) {
      auto kf = well;
      Pair z{.z = {0.1F, 0.2F}, .variance = {1.0F, 1.0F}};
      (field < 2 ? z.z(field) : z.variance(field - 2)) = bad;
      EXPECT_NE(kf.update(z, 1e9F).verdict, Verdict::kAccepted) << field << " = " << bad;
      EXPECT_EQ(kf.x.value, well.x.value);
      EXPECT_EQ(covariance(kf).packed(), covariance(well).packed());
      filter::LinearMotion<float, 3> motion;
      if (field < 3) motion.f(field, 1) = bad;
      if (field == 3) motion.q(1, 1) = bad;
      EXPECT_FALSE(kf.predict(motion)) << field << " = " << bad;
      EXPECT_EQ(kf.x.value, well.x.value);
      EXPECT_EQ(covariance(kf).packed(), covariance(well).packed());
    }
}

TYPED_TEST(KalmanForm, StaysPositiveOverSharpMeasurements) {
  using Filter = typename TypeParam::template Of<VectorState<float, 3>>;
  auto kf = rolling<Filter>();
  filter::LinearMotion<float, 3> motion;
  motion.f(0, 1) = motion.f(1, 2) = 0.5F;
  motion.q = Symmetric<float, 3>::diagonal({1e-4F, 1e-4F, 1e-4F});
  for (int k = 0; k < 2000; ++k) {
    EXPECT_TRUE(kf.predict(motion));
    static_cast<void>(kf.update(Pair{.z = {0.0F, 0.0F}, .variance = {1e-8F, 1e-8F}}, 1e9F));
    ASSERT_GT(test::least_eigenvalue(covariance(kf)), 0) << k;
  }
}

/// A measurement 10^8 times sharper than the prior, two states that are nearly the same (Bierman 1977, sec. V.5 gives
/// such an example): P - K s K^T alone is indefinite there.
TEST(KalmanForms, SurviveWhereSubtractionAloneFails) {
  const auto run = [](auto kf) {
    set_covariance<decltype(kf), 2>(kf, Symmetric<float, 2>::diagonal({1e6F, 1e6F}));
    const Vector<float, 1> z = Vector<float, 1>::Zero(), r = Vector<float, 1>::Constant(1e-4F);
    filter::LinearMeasurement<float, 2, 1> first{.z = z, .variance = r}, second{.z = z, .variance = r};
    first.h << 1.0F, 1e-3F;
    second.h << 1.0F, 1.0F;
    static_cast<void>(kf.update(first, 1e9F));
    static_cast<void>(kf.update(second, 1e9F));
    return test::least_eigenvalue(covariance(kf));
  };
  using State = VectorState<float, 2>;
  EXPECT_GT(run(filter::SequentialKalman<State>{}), 0.0);
  EXPECT_GT(run(filter::UdKalman<State>{}), 0.0);
  EXPECT_GT(run(filter::SquareRootKalman<State>{}), 0.0);
}

// Bar-Shalom, Li, Kirubarajan 2001, sec. 5.2.3: for any gain, the form is a sum of two covariances.
TEST(Joseph, StaysPositiveWithAGainThatIsNotOptimal) {
  std::mt19937 random(22);
  std::normal_distribution<float> normal;
  int conventional_failed = 0;
  for (int i = 0; i < 1000; ++i) {
    filter::Matrix<float, 3, 3> a;
    filter::Matrix<float, 3, 2> gain;
    filter::Matrix<float, 2, 3> h;
    for (int k = 0; k < 9; ++k) a(k / 3, k % 3) = normal(random);
    for (int k = 0; k < 6; ++k) gain(k % 3, k / 3) = normal(random), h(k / 3, k % 3) = normal(random);
    const auto p =
        Symmetric<float, 3>::upper_of(a.lazyProduct(a.transpose()) + filter::Matrix<float, 3, 3>::Identity() * 0.1F);
    const Vector<float, 2> noise{0.5F, 0.2F};
    EXPECT_GT(test::least_eigenvalue(filter::joseph_update(p, gain, h, noise)), 0);
    const filter::Matrix<float, 3, 3> left = filter::Matrix<float, 3, 3>::Identity() - gain * h;
    conventional_failed += test::least_eigenvalue(Symmetric<float, 3>::upper_of(left * p.dense())) <= 0 ? 1 : 0;
  }
  EXPECT_GT(conventional_failed, 500) << "(I - K H) P with the same gains";
}

TEST(Ud, FactorIsUnitUpperTriangularAndGivesPBack) {
  std::mt19937 random(23);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 100; ++i) {
    Eigen::Matrix4d a;
    for (int k = 0; k < 16; ++k) a(k / 4, k % 4) = normal(random);
    const Eigen::Matrix4d p = a * a.transpose();
    const filter::Ud<double, 4> ud(Symmetric<double, 4>::upper_of(p));
    EXPECT_LT((ud.covariance().dense() - p).norm(), 1e-13 * p.norm());
    for (int c = 0; c < 4; ++c)
      for (int r = c; r < 4; ++r) EXPECT_EQ(ud.u()(r, c), r == c ? 1.0 : 0.0);
  }
}

// A range of 1 cm to a target whose place is known to 2 m. One linearisation falls short of the circle by the squared
// error across over twice the range. The reference is the posterior's maximum on a fine grid.
TEST(IteratedEkf, ReachesThePosteriorsMaximumWhereOneLinearisationDoesNot) {
  using State = VectorState<double, 4>;
  const model::TargetRange<State> z{.range_m = 5.0, .sigma_range_m = 0.01};
  const auto prior = Symmetric<double, 4>::diagonal({4, 1, 4, 1});
  const State start{{2.0, 0.0, 2.0, 0.0}};
  filter::Ekf<State> once;
  filter::IteratedEkf<State, 6> again;
  once.x = again.x = start;
  once.p = again.p = prior;
  ASSERT_EQ(once.update(z, 1e9).verdict, Verdict::kAccepted);
  ASSERT_EQ(again.update(z, 1e9).verdict, Verdict::kAccepted);
  // By symmetry the maximum lies on the diagonal: minimise (2 - t)^2 / 4 per axis and the range's term over t.
  double best = 0, least = 1e300;
  for (int i = 0; i <= 1000000; ++i) {
    const double t = 3.0 + i * 1e-6;
    const double cost = 2 * (2 - t) * (2 - t) / 4 + std::pow((5.0 - t * std::sqrt(2.0)) / 0.01, 2);
    if (cost < least) least = cost, best = t;
  }
  EXPECT_NEAR(again.x.value(0), best, 2e-6);
  EXPECT_NEAR(again.x.value(2), best, 2e-6);
  // Off the diagonal the arc matters.
  once.x = again.x = State{{4.0, 0.0, 0.5, 0.0}};
  once.p = again.p = Symmetric<double, 4>::diagonal({0.01, 1, 9, 1});
  ASSERT_EQ(once.update(z, 1e9).verdict, Verdict::kAccepted);
  ASSERT_EQ(again.update(z, 1e9).verdict, Verdict::kAccepted);
  const auto range = [](const auto& kf) { return std::hypot(kf.x.value(0), kf.x.value(2)); };
  EXPECT_GT(std::abs(range(once) - 5.0), 0.3);
  EXPECT_LT(std::abs(range(again) - 5.0), 0.05);
}

}  // namespace
}  // namespace tetap
