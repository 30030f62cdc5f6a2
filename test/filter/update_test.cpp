// SPDX-License-Identifier: Apache-2.0
#include "tetap/filter/update.hpp"

#include <gtest/gtest.h>
#include <Eigen/Dense>
#include <limits>
#include <random>

namespace tetap {
namespace {

constexpr std::array<int, 3> kTouches{0, 2, 4};
using Covariance = filter::Symmetric<float, 5>;

struct Case {
  Covariance p;
  filter::Matrix<float, 3, 3> h;
  filter::Vector<float, 3> nu, noise;
};

Case random_case(std::mt19937& random) {
  std::normal_distribution<float> normal;
  std::uniform_real_distribution<float> magnitude(-2.0F, 2.0F);
  filter::Matrix<float, 5, 5> a;
  Case c;
  for (int i = 0; i < 25; ++i) a(i / 5, i % 5) = normal(random);
  c.p = Covariance::upper_of(a.lazyProduct(a.transpose()) + filter::Matrix<float, 5, 5>::Identity() * 0.1F);
  for (int i = 0; i < 9; ++i) c.h(i / 3, i % 3) = normal(random);
  for (int i = 0; i < 3; ++i) {
    c.nu(i) = normal(random);
    c.noise(i) = std::exp(magnitude(random));
  }
  return c;
}

// The textbook update in double: K = P H' S^-1, P+ = (I - K H) P (I - K H)' + K R K'.
struct Joseph {
  Eigen::Matrix<double, 5, 1> dx;
  Eigen::Matrix<double, 5, 5> p;
  double nis;
  Joseph(const Case& c) {
    Eigen::Matrix<double, 3, 5> h = Eigen::Matrix<double, 3, 5>::Zero();
    for (std::size_t k = 0; k < kTouches.size(); ++k) h.col(kTouches[k]) = c.h.col(static_cast<int>(k)).cast<double>();
    const Eigen::Matrix<double, 5, 5> prior = c.p.dense().cast<double>();
    const Eigen::Matrix3d r = c.noise.cast<double>().asDiagonal();
    const Eigen::Matrix3d s = h * prior * h.transpose() + r;
    const Eigen::Matrix<double, 5, 3> k = prior * h.transpose() * s.inverse();
    const Eigen::Matrix<double, 5, 5> left = Eigen::Matrix<double, 5, 5>::Identity() - k * h;
    dx = k * c.nu.cast<double>();
    p = left * prior * left.transpose() + k * r * k.transpose();
    nis = c.nu.cast<double>().dot(s.inverse() * c.nu.cast<double>());
  }
};

TEST(Update, EqualsTheJointJosephUpdateInDouble) {
  std::mt19937 random(4);
  for (int i = 0; i < 2000; ++i) {
    Case c = random_case(random);
    const Joseph expected(c);
    const double prior = c.p.dense().cast<double>().norm();
    const auto got = filter::update<float, 5, 3>(c.p, c.h, kTouches, c.nu, c.noise, 1e9F);
    ASSERT_EQ(got.innovation.verdict, filter::Verdict::kAccepted);
    EXPECT_NEAR(static_cast<double>(got.innovation.nis), expected.nis, 2e-5 * (1 + expected.nis));
    EXPECT_LT((got.dx.cast<double>() - expected.dx).norm(), 3e-5 * (0.1 + expected.dx.norm()));
    EXPECT_LT((c.p.dense().cast<double>() - expected.p).norm(), 2e-6 * prior);
    EXPECT_TRUE(c.p.positive_definite());
  }
}

TEST(Update, APerfectMeasurementMovesNothing) {
  std::mt19937 random(5);
  Case c = random_case(random);
  c.nu.setZero();
  const auto got = filter::update<float, 5, 3>(c.p, c.h, kTouches, c.nu, c.noise, 9.0F);
  EXPECT_EQ(got.innovation.nis, 0.0F);
  EXPECT_EQ(got.dx, (filter::Vector<float, 5>::Zero()));
}

TEST(Update, NeverMakesAVarianceLarger) {
  std::mt19937 random(6);
  for (int i = 0; i < 500; ++i) {
    Case c = random_case(random);
    const Covariance before = c.p;
    static_cast<void>(filter::update<float, 5, 3>(c.p, c.h, kTouches, c.nu, c.noise, 1e9F));
    for (int k = 0; k < 5; ++k) EXPECT_LE(c.p(k, k), before(k, k));
  }
}

TEST(Update, StaysPositiveWhenTheMeasurementIsTenMillionTimesBetter) {
  for (const float prior : {1.0F, 1e4F, 1e8F}) {
    Covariance p = Covariance::diagonal({prior, prior, prior, prior, prior});
    const filter::Matrix<float, 3, 3> h = filter::Matrix<float, 3, 3>::Identity();
    const filter::Vector<float, 3> tiny = filter::Vector<float, 3>::Constant(prior * 1e-9F);
    for (int k = 0; k < 50; ++k) {
      static_cast<void>(filter::update<float, 5, 3>(p, h, kTouches, filter::Vector<float, 3>::Zero(), tiny, 9.0F));
      ASSERT_TRUE(p.positive_definite()) << prior << " after " << k;
    }
  }
}

TEST(Update, NotFiniteOrSingularIsRefusedAndChangesNothing) {
  std::mt19937 random(7);
  const float nan = std::numeric_limits<float>::quiet_NaN(), infinity = std::numeric_limits<float>::infinity();
  for (const float bad : {nan, infinity, -infinity}) {
    for (int where = 0; where < 3; ++where) {
      Case c = random_case(random);
      const Covariance before = c.p;
      (where == 0 ? c.nu(1) : where == 1 ? c.noise(1) : c.h(1, 1)) = bad;
      const auto got = filter::update<float, 5, 3>(c.p, c.h, kTouches, c.nu, c.noise, 9.0F);
      EXPECT_NE(got.innovation.verdict, filter::Verdict::kAccepted) << bad << where;
      EXPECT_EQ(c.p.packed(), before.packed());
      EXPECT_EQ(got.dx, (filter::Vector<float, 5>::Zero()));
    }
  }
  Covariance nothing;
  const auto singular =
      filter::update<float, 5, 3>(nothing, filter::Matrix<float, 3, 3>::Identity(), kTouches,
                                  filter::Vector<float, 3>::Zero(), filter::Vector<float, 3>::Zero(), 9.0F);
  EXPECT_EQ(singular.innovation.verdict, filter::Verdict::kSingular);
}

}  // namespace
}  // namespace tetap
