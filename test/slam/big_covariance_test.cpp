// SPDX-License-Identifier: Apache-2.0
#include "filter/big_covariance.hpp"

#include <gtest/gtest.h>
#include <random>
#include <vector>

namespace tetap {
namespace {

constexpr int kMost = 12;
using Covariance = filter::BigCovariance<float, kMost>;
using Dense = std::vector<std::vector<double>>;

std::size_t at(int i) { return static_cast<std::size_t>(i); }

/// A covariance of n states, and the same in full.
struct Both {
  Covariance p;
  Dense full;
  std::mt19937 random{9};
  std::normal_distribution<float> normal;

  explicit Both(int n) : full(at(n), std::vector<double>(at(n))) {
    std::vector<std::vector<float>> a(at(n), std::vector<float>(at(n)));
    for (auto& row : a)
      for (float& value : row) value = normal(random);
    for (int c = 0; c < n; ++c) {
      Covariance::States column{};
      for (int r = 0; r <= c; ++r) {
        float sum = r == c ? 0.5F : 0.0F;
        for (int k = 0; k < n; ++k) sum += a[at(r)][at(k)] * a[at(c)][at(k)];
        column[at(r)] = sum;
        full[at(r)][at(c)] = full[at(c)][at(r)] = static_cast<double>(sum);
      }
      EXPECT_TRUE(p.add(column, column[at(c)]));
    }
  }
  Covariance::States states() {
    Covariance::States s{};
    for (float& value : s) value = normal(random);
    return s;
  }
  void expect_equal(double tolerance) const {
    for (int r = 0; r < p.size(); ++r)
      for (int c = 0; c < p.size(); ++c)
        EXPECT_NEAR(static_cast<double>(p(r, c)), full[at(r)][at(c)], tolerance) << r << "," << c;
  }
};

TEST(BigCovariance, ARankTwoUpdateIsThatOfTheFullMatrix) {
  Both both(9);
  const std::array<Covariance::States, 2> g{both.states(), both.states()};
  both.p.subtract(g);
  for (int r = 0; r < 9; ++r)
    for (int c = 0; c < 9; ++c)
      for (std::size_t k = 0; k < 2; ++k)
        both.full[at(r)][at(c)] -= static_cast<double>(g[k][at(r)]) * static_cast<double>(g[k][at(c)]);
  both.expect_equal(1e-5);
}

TEST(BigCovariance, ASparseRowTimesP) {
  Both both(9);
  Covariance::States product{};
  both.p.times(std::array{1.5F, -2.0F, 0.25F}, std::array{0, 4, 8}, product);
  for (int n = 0; n < 9; ++n)
    EXPECT_NEAR(static_cast<double>(product[at(n)]),
                1.5 * both.full[at(n)][0] - 2.0 * both.full[at(n)][4] + 0.25 * both.full[at(n)][8], 1e-4);
}

TEST(BigCovariance, AShearIsTPT) {
  Both both(7);
  Covariance::States u = both.states();
  u[2] = 0;
  both.p.shear(2, u);
  const Dense was = both.full;
  for (int r = 0; r < 7; ++r)
    for (int c = 0; c < 7; ++c) {
      const auto ur = static_cast<double>(u[at(r)]), uc = static_cast<double>(u[at(c)]);
      both.full[at(r)][at(c)] += ur * was[2][at(c)] + was[at(r)][2] * uc + was[2][2] * ur * uc;
    }
  both.expect_equal(1e-4);
}

TEST(BigCovariance, AddingAndRemovingChangesNoBitOfTheOthers) {
  Both both(9);
  const Covariance before = both.p;
  ASSERT_TRUE(both.p.add(both.states(), 4.0F));
  ASSERT_TRUE(both.p.add(both.states(), 5.0F));
  both.p.remove(9, 2);
  ASSERT_EQ(both.p.size(), 9);
  for (int r = 0; r < 9; ++r)
    for (int c = 0; c < 9; ++c) EXPECT_EQ(both.p(r, c), before(r, c));
}

TEST(BigCovariance, RemovingAPairPutsTheLastPairInItsPlace) {
  for (const int first : {3, 5, 7}) {
    Both both(9);
    const Covariance before = both.p;
    both.p.remove(first, 2);
    ASSERT_EQ(both.p.size(), 7);
    const auto was = [&](int i) { return i == first ? 7 : i == first + 1 ? 8 : i; };
    for (int r = 0; r < 7; ++r)
      for (int c = 0; c < 7; ++c) EXPECT_EQ(both.p(r, c), before(was(r), was(c))) << first << ": " << r << "," << c;
  }
}

TEST(BigCovariance, WhenFullAStateIsRefused) {
  Both both(kMost);
  EXPECT_TRUE(both.p.full());
  EXPECT_FALSE(both.p.add(both.states(), 1.0F));
  EXPECT_EQ(both.p.size(), kMost);
  both.expect_equal(0);
}

}  // namespace
}  // namespace tetap
