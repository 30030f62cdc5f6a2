// SPDX-License-Identifier: Apache-2.0
// Fusion without motion. Each form's claim stands against the covariance that its own weights give the truth. The judge
// knows the correlation of the errors, the fusion does not.
#include "tetap/filter/static_fusion.hpp"

#include <gtest/gtest.h>
#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <random>

namespace tetap {
namespace {

using Eigen::Matrix3d;
using filter::Symmetric;
template <class Scalar>
using Estimate3 = filter::Estimate<Scalar, 3>;

class Draw {
 public:
  explicit Draw(unsigned seed) : random_(seed) {}
  Matrix3d matrix() {
    Matrix3d m;
    for (int i = 0; i < 9; ++i) m(i / 3, i % 3) = normal_(random_);
    return m;
  }
  Matrix3d covariance() {
    const Matrix3d a = matrix();
    return a * a.transpose() + 0.05 * Matrix3d::Identity();
  }
  /// Cov(a, b) for covariances pa, pb: any contraction between their roots; `most` is its largest singular value.
  Matrix3d cross(const Matrix3d& pa, const Matrix3d& pb, double most) {
    const Eigen::JacobiSVD<Matrix3d> svd(matrix(), Eigen::ComputeFullU | Eigen::ComputeFullV);
    Eigen::Vector3d size;
    for (int i = 0; i < 3; ++i) size(i) = most * uniform_(random_);
    size(0) = most;
    const Matrix3d contraction = svd.matrixU() * size.asDiagonal() * svd.matrixV().transpose();
    return root(pa) * contraction * root(pb).transpose();
  }
  double uniform() { return uniform_(random_); }

 private:
  static Matrix3d root(const Matrix3d& p) { return p.llt().matrixL(); }
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
  std::uniform_real_distribution<double> uniform_{0.0, 1.0};
};

/// Least eigenvalue of claimed - true, in units of the true covariance: below zero is too sure.
double margin(const Matrix3d& claimed, const Matrix3d& truth) {
  const Eigen::GeneralizedSelfAdjointEigenSolver<Matrix3d> solver(claimed - truth, truth);
  return solver.eigenvalues()(0);
}
/// Covariance of the errors of K a + L b, with the cross covariance that the judge knows.
Matrix3d true_covariance(const Matrix3d& k, const Matrix3d& pa, const Matrix3d& l, const Matrix3d& pb,
                         const Matrix3d& c) {
  const Matrix3d mixed = k * c * l.transpose();
  return k * pa * k.transpose() + l * pb * l.transpose() + mixed + mixed.transpose();
}
Estimate3<double> estimate(const Matrix3d& p) { return {.p = Symmetric<double, 3>::upper_of(p)}; }

TEST(InverseVariance, ScalarsAddTheirInformation) {
  const std::array<filter::Estimate<double, 1>, 3> sensors{
      {{.x = filter::Vector<double, 1>{10.0}, .p = Symmetric<double, 1>::diagonal({4.0})},
       {.x = filter::Vector<double, 1>{12.0}, .p = Symmetric<double, 1>::diagonal({1.0})},
       {.x = filter::Vector<double, 1>{11.0}, .p = Symmetric<double, 1>::diagonal({2.0})}}};
  const auto fused = filter::inverse_variance<double, 1>(sensors);
  ASSERT_TRUE(fused.valid);
  EXPECT_DOUBLE_EQ(fused.estimate.p(0, 0), 1 / (0.25 + 1 + 0.5));
  EXPECT_DOUBLE_EQ(fused.estimate.x(0), (2.5 + 12 + 5.5) / 1.75);
}

// x = (H' W H)^-1 H' W z with the estimates stacked.
TEST(InverseVariance, VectorsAreTheWeightedLeastSquaresSolution) {
  Draw draw(41);
  for (int i = 0; i < 100; ++i) {
    std::array<Estimate3<double>, 4> sensors;
    Eigen::Matrix<double, 12, 3> h;
    Eigen::Matrix<double, 12, 12> w = Eigen::Matrix<double, 12, 12>::Zero();
    Eigen::Matrix<double, 12, 1> z;
    for (int s = 0; s < 4; ++s) {
      const Matrix3d p = draw.covariance();
      sensors[static_cast<std::size_t>(s)] = estimate(p);
      sensors[static_cast<std::size_t>(s)].x = draw.matrix().col(0);
      h.block<3, 3>(3 * s, 0).setIdentity();
      w.block<3, 3>(3 * s, 3 * s) = p.inverse();
      z.segment<3>(3 * s) = sensors[static_cast<std::size_t>(s)].x;
    }
    const Eigen::Matrix3d information = h.transpose() * w * h;
    const Eigen::Vector3d expected = information.inverse() * (h.transpose() * w * z);
    const auto fused = filter::inverse_variance<double, 3>(sensors);
    ASSERT_TRUE(fused.valid);
    EXPECT_LT((fused.estimate.x - expected).norm(), 1e-10 * (1 + expected.norm()));
    EXPECT_LT((fused.estimate.p.dense() - information.inverse()).norm(), 1e-10 * information.inverse().norm());
  }
}

TEST(CovarianceIntersection, IsNeverTooSureForAnyOfTenThousandCorrelations) {
  Draw draw(42);
  int independence_too_sure = 0;
  double worst = 1e9, tightest = 1e9;
  for (int i = 0; i < 10000; ++i) {
    const Matrix3d pa = draw.covariance(), pb = draw.covariance();
    const Matrix3d c = draw.cross(pa, pb, draw.uniform());
    const auto fused = filter::covariance_intersection(estimate(pa), estimate(pb));
    ASSERT_TRUE(fused.valid);
    const Matrix3d p = fused.estimate.p.dense();
    const Matrix3d k = fused.omega * p * pa.inverse(), l = (1 - fused.omega) * p * pb.inverse();
    EXPECT_LT((k + l - Matrix3d::Identity()).norm(), 1e-9) << "no bias";
    const double ours = margin(p, true_covariance(k, pa, l, pb, c));
    worst = std::min(worst, ours);
    const std::array<Estimate3<double>, 2> both{estimate(pa), estimate(pb)};
    const Matrix3d q = filter::inverse_variance<double, 3>(both).estimate.p.dense();
    const double theirs = margin(q, true_covariance(q * pa.inverse(), pa, q * pb.inverse(), pb, c));
    independence_too_sure += theirs < -1e-9 ? 1 : 0;
    tightest = std::min(tightest, theirs);
  }
  EXPECT_GT(worst, -1e-9);
  EXPECT_GT(independence_too_sure, 5000) << "assumed an independence that is not there";
  EXPECT_LT(tightest, -0.4) << "up to half of the true variance is missing";
}

TEST(InverseVariance, IsExactWhenIndependenceIsThere) {
  Draw draw(43);
  for (int i = 0; i < 1000; ++i) {
    const Matrix3d pa = draw.covariance(), pb = draw.covariance();
    const std::array<Estimate3<double>, 2> both{estimate(pa), estimate(pb)};
    const Matrix3d q = filter::inverse_variance<double, 3>(both).estimate.p.dense();
    const Matrix3d truth = true_covariance(q * pa.inverse(), pa, q * pb.inverse(), pb, Matrix3d::Zero());
    EXPECT_LT((q - truth).norm(), 1e-11 * truth.norm());
  }
}

TEST(CovarianceIntersection, OmegaGivesTheLeastDeterminant) {
  Draw draw(44);
  for (int i = 0; i < 50; ++i) {
    const Matrix3d pa = draw.covariance(), pb = draw.covariance();
    const auto fused = filter::covariance_intersection(estimate(pa), estimate(pb));
    double least = 1e300;
    for (int k = 0; k <= 20000; ++k) {
      const double w = k / 20000.0;
      least = std::min(least, 1 / (w * pa.inverse() + (1 - w) * pb.inverse()).determinant());
    }
    EXPECT_NEAR(fused.estimate.p.dense().determinant() / least, 1.0, 1e-5);
  }
}

TEST(CovarianceIntersection, TheSameEstimateTwiceTeachesNothing) {
  Draw draw(45);
  const Matrix3d p = draw.covariance();
  const auto fused = filter::covariance_intersection(estimate(p), estimate(p));
  EXPECT_LT((fused.estimate.p.dense() - p).norm(), 1e-12 * p.norm());
}

template <class Scalar, int N>
void expect_mean(const Eigen::Matrix<Scalar, N, N>& p, const Eigen::Matrix<Scalar, N, 1>& far, Scalar tolerance) {
  filter::Estimate<Scalar, N> a{.p = Symmetric<Scalar, N>::upper_of(p)}, b = a;
  b.x = far;
  for (const auto& fused : {filter::covariance_intersection(a, b), filter::covariance_intersection(b, a)}) {
    ASSERT_TRUE(fused.valid);
    EXPECT_NEAR(fused.omega, Scalar(0.5F), Scalar(1e-5F));
    EXPECT_LT((fused.estimate.x - far / 2).norm(), tolerance * far.norm());
    EXPECT_LT((fused.estimate.p.dense() - p).norm(), tolerance * p.norm());
  }
}

// Every weight claims the same covariance; only the middle favours neither.
TEST(CovarianceIntersection, EqualCovariancesGiveTheMeanAndLeaveTheCovariance) {
  Draw draw(49);
  for (const double sigma_m : {1e-3, 0.3, 1.0, 7.0, 5e3}) {
    const double variance = sigma_m * sigma_m;
    expect_mean<float, 2>(Eigen::Matrix2f::Identity() * static_cast<float>(variance), {3, -1}, 1e-5F);
    expect_mean<double, 2>(Eigen::Matrix2d::Identity() * variance, {3, -1}, 1e-5);
    expect_mean<double, 1>(Eigen::Matrix<double, 1, 1>::Constant(variance), Eigen::Matrix<double, 1, 1>(2.0), 1e-5);
  }
  for (int i = 0; i < 200; ++i) {
    const Matrix3d p = draw.covariance();
    const Eigen::Vector3d far = draw.matrix().col(0);
    expect_mean<double, 3>(p, far, 1e-5);
    expect_mean<float, 3>(p.cast<float>(), far.cast<float>(), 1e-3F);
  }
}

// A better estimate still wins, and rounding in a covariance does not turn the mean into one of its ends.
TEST(CovarianceIntersection, TheMeanHoldsToRoundingAndABetterEstimateStands) {
  const auto omega = [](float ratio) {
    const filter::Estimate<float, 2> a{.p = Symmetric<float, 2>::diagonal({0.09F, 0.09F})};
    const filter::Estimate<float, 2> b{.p = Symmetric<float, 2>::diagonal({0.09F * ratio, 0.09F * ratio})};
    return filter::covariance_intersection(a, b).omega;
  };
  EXPECT_NEAR(omega(1.0000002F), 0.5F, 1e-5F);
  EXPECT_NEAR(omega(0.9999998F), 0.5F, 1e-5F);
  EXPECT_GT(omega(1.01F), 0.99F);
  EXPECT_LT(omega(0.99F), 0.01F);
}

// Independent fixes of equal sigma: the mean's error is a share of 1/sqrt(2) of one fix's, and the claim holds.
TEST(CovarianceIntersection, EqualFixesThatAreIndependentHaveTheErrorOfTheirMean) {
  std::mt19937 random(50);
  std::normal_distribution<float> normal(0.0F, 0.3F);
  double squares = 0;
  constexpr int kFixes = 20'000;
  for (int i = 0; i < kFixes; ++i) {
    std::array<filter::Estimate<float, 2>, 2> fix;
    for (auto& one : fix) {
      one.x = {normal(random), normal(random)};
      one.p = Symmetric<float, 2>::diagonal({0.09F, 0.09F});
    }
    squares += static_cast<double>(filter::covariance_intersection(fix[0], fix[1]).estimate.x.squaredNorm());
  }
  EXPECT_NEAR(std::sqrt(squares / kFixes), 0.3, 0.005);  // one fix has 0.42 m
}

filter::SplitEstimate<double, 3> split(const Matrix3d& correlated, const Matrix3d& independent) {
  return {.correlated = Symmetric<double, 3>::upper_of(correlated),
          .independent = Symmetric<double, 3>::upper_of(independent)};
}

TEST(SplitCovarianceIntersection, IsNeverTooSureAndSurerThanIntersectionWhereASharedPartIsSmall) {
  Draw draw(46);
  double worst = 1e9, gain = 0;
  for (int i = 0; i < 10000; ++i) {
    const Matrix3d ca = draw.covariance(), cb = draw.covariance();
    const Matrix3d ia = 3 * draw.covariance(), ib = 3 * draw.covariance();
    const Matrix3d c = draw.cross(ca, cb, draw.uniform());
    const auto fused = filter::split_covariance_intersection(split(ca, ia), split(cb, ib));
    ASSERT_TRUE(fused.valid);
    const Matrix3d p = fused.estimate.total().dense();
    const Matrix3d k = p * (ca / fused.omega + ia).inverse(), l = p * (cb / (1 - fused.omega) + ib).inverse();
    worst = std::min(worst, margin(p, true_covariance(k, ca + ia, l, cb + ib, c)));
    const Matrix3d independent = fused.estimate.independent.dense();
    EXPECT_LT((independent - k * ia * k.transpose() - l * ib * l.transpose()).norm(), 1e-9 * p.norm());
    const auto plain = filter::covariance_intersection(estimate(ca + ia), estimate(cb + ib));
    gain += std::log(plain.estimate.p.dense().determinant() / p.determinant()) / 10000;
  }
  EXPECT_GT(worst, -1e-9);
  EXPECT_GT(gain, 0.3);
}

TEST(SplitCovarianceIntersection, ItsEndsAreIntersectionAndInverseVariance) {
  Draw draw(47);
  for (int i = 0; i < 100; ++i) {
    const Matrix3d pa = draw.covariance(), pb = draw.covariance();
    const auto none = filter::split_covariance_intersection(split(pa, Matrix3d::Zero()), split(pb, Matrix3d::Zero()));
    const auto intersection = filter::covariance_intersection(estimate(pa), estimate(pb));
    const Matrix3d unit = pa(0, 0) * Matrix3d::Identity();
    const auto equal =
        filter::split_covariance_intersection(split(unit, Matrix3d::Zero()), split(unit, Matrix3d::Zero()));
    EXPECT_NEAR(equal.omega, 0.5, 1e-5);
    EXPECT_NEAR(none.estimate.total().dense().determinant() / intersection.estimate.p.dense().determinant(), 1, 1e-3);
    const auto all = filter::split_covariance_intersection(split(Matrix3d::Zero(), pa), split(Matrix3d::Zero(), pb));
    const std::array<Estimate3<double>, 2> both{estimate(pa), estimate(pb)};
    const Matrix3d q = filter::inverse_variance<double, 3>(both).estimate.p.dense();
    EXPECT_LT((all.estimate.total().dense() - q).norm(), 1e-10 * q.norm());
    EXPECT_LT((all.estimate.independent.dense() - q).norm(), 1e-10 * q.norm());
  }
}

TEST(StaticFusion, FloatGivesWhatDoubleGives) {
  Draw draw(48);
  for (int i = 0; i < 200; ++i) {
    const Matrix3d pa = draw.covariance(), pb = draw.covariance();
    Estimate3<float> a{.p = Symmetric<float, 3>::upper_of(pa.cast<float>())};
    Estimate3<float> b{.p = Symmetric<float, 3>::upper_of(pb.cast<float>())};
    const auto fused = filter::covariance_intersection(a, b);
    const auto exact = filter::covariance_intersection(estimate(pa), estimate(pb));
    ASSERT_TRUE(fused.valid);
    EXPECT_NEAR(static_cast<double>(fused.omega), exact.omega, 2e-2);
    const double determinant = fused.estimate.p.dense().cast<double>().determinant();
    EXPECT_NEAR(determinant / exact.estimate.p.dense().determinant(), 1, 2e-3);
  }
}

TEST(StaticFusion, WhatIsNoCovarianceIsRefused) {
  const auto good = estimate(Matrix3d::Identity());
  for (const double bad : {0.0, -1.0, std::nan(""), HUGE_VAL}) {
    auto broken = good;
    broken.p(1, 1) = bad;
    const std::array<Estimate3<double>, 2> both{good, broken};
    EXPECT_FALSE((filter::inverse_variance<double, 3>(both).valid)) << bad;
    EXPECT_FALSE(filter::covariance_intersection(good, broken).valid) << bad;
    EXPECT_FALSE(filter::covariance_intersection(broken, good).valid) << bad;
    const Matrix3d one = Matrix3d::Identity();
    auto half = split(one, one);
    half.correlated(2, 2) = bad;
    half.independent(2, 2) = bad > 0 ? 1.0 : -1e7;
    EXPECT_FALSE(filter::split_covariance_intersection(half, split(one, one)).valid) << bad;
    EXPECT_FALSE(filter::split_covariance_intersection(split(one, one), half).valid) << bad;
  }
  EXPECT_FALSE((filter::inverse_variance<double, 3>({}).valid)) << "none";
}

TEST(StaticFusion, AnEstimateThatIsNoNumberIsRefused) {
  const auto good = estimate(Matrix3d::Identity());
  const Matrix3d one = Matrix3d::Identity();
  for (const double bad : {std::nan(""), HUGE_VAL, -HUGE_VAL}) {
    for (int n = 0; n < 3; ++n) {
      auto broken = good;
      broken.x(n) = bad;
      const std::array<Estimate3<double>, 2> both{good, broken};
      EXPECT_FALSE((filter::inverse_variance<double, 3>(both).valid)) << bad;
      EXPECT_FALSE(filter::covariance_intersection(good, broken).valid) << bad;
      EXPECT_FALSE(filter::covariance_intersection(broken, good).valid) << bad;
      auto half = split(one, one);
      half.x(n) = bad;
      EXPECT_FALSE(filter::split_covariance_intersection(half, split(one, one)).valid) << bad;
    }
  }
}

}  // namespace
}  // namespace tetap
