// SPDX-License-Identifier: Apache-2.0
#include "tetap/filter/symmetric.hpp"

#include "support/least_eigenvalue.hpp"

#include <gtest/gtest.h>
#include <limits>
#include <random>

namespace tetap {
namespace {

template <int N>
filter::Symmetric<float, N> random_covariance(std::mt19937& random, float scale = 1.0F) {
  std::normal_distribution<float> normal;
  filter::Matrix<float, N, N> a;
  for (int i = 0; i < N * N; ++i) a(i / N, i % N) = normal(random) * scale;
  return filter::Symmetric<float, N>::upper_of(a.lazyProduct(a.transpose()) +
                                               filter::Matrix<float, N, N>::Identity() * 0.01F);
}

TEST(Symmetric, OneNumberIsReadAndWrittenFromBothSides) {
  filter::Symmetric<float, 4> p;
  p(1, 3) = 7.0F;
  EXPECT_EQ(p(3, 1), 7.0F);
  p(3, 1) = 8.0F;
  EXPECT_EQ(p(1, 3), 8.0F);
  EXPECT_EQ(p.packed().size(), 10U);
}

TEST(Symmetric, DenseAndBackIsTheSame) {
  std::mt19937 random(1);
  const auto p = random_covariance<5>(random);
  EXPECT_EQ((filter::Symmetric<float, 5>::upper_of(p.dense()).packed()), p.packed());
  EXPECT_EQ(p.dense(), p.dense().transpose().eval());
}

TEST(Symmetric, PropagateIsFPFtPlusQ) {
  std::mt19937 random(2);
  for (int i = 0; i < 100; ++i) {
    const auto p = random_covariance<4>(random), q = random_covariance<4>(random, 0.1F);
    filter::Matrix<float, 4, 4> f = random_covariance<4>(random).dense();
    const Eigen::Matrix4d expected =
        f.cast<double>() * p.dense().cast<double>() * f.cast<double>().transpose() + q.dense().cast<double>();
    const Eigen::Matrix4d got = filter::propagate(p, f, q).dense().cast<double>();
    EXPECT_LT((got - expected).norm(), 1e-6 * expected.norm());
  }
}

TEST(Symmetric, PositiveDefiniteAgreesWithTheEigenvalues) {
  std::mt19937 random(3);
  std::normal_distribution<float> shift(0.0F, 2.0F);
  int yes = 0, no = 0;
  for (int i = 0; i < 500; ++i) {
    auto p = random_covariance<4>(random);
    const float d = shift(random);
    for (int k = 0; k < 4; ++k) p(k, k) += d;
    const double smallest = test::least_eigenvalue(p);
    if (std::abs(smallest) < 1e-4) continue;
    EXPECT_EQ(p.positive_definite(), smallest > 0) << smallest;
    (smallest > 0 ? yes : no)++;
  }
  EXPECT_GT(yes, 50);
  EXPECT_GT(no, 50);
}

TEST(Symmetric, NanAndInfinityAreNotPositiveDefinite) {
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()})
    for (int r = 0; r < 3; ++r)
      for (int c = r; c < 3; ++c) {
        auto p = filter::Symmetric<float, 3>::diagonal({1, 1, 1});
        p(r, c) = bad;
        EXPECT_FALSE(p.positive_definite()) << r << c;
      }
}

}  // namespace
}  // namespace tetap
