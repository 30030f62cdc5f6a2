// SPDX-License-Identifier: Apache-2.0
#include "tetap/filter/big_covariance.hpp"

#include <gtest/gtest.h>
#include <algorithm>
#include <cmath>
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

TEST(BigCovariance, GainsAndTransportInOnePass) {
  for (const int n : {8, 9}) {  // an even and an odd number of columns
    Both both(n);
    Covariance::Rows<6> w{};
    for (auto& row : w)
      for (float& value : row) value = both.normal(both.random);
    both.p.correct<4>(w);
    for (int r = 0; r < n; ++r)
      for (int c = 0; c < n; ++c) {
        const auto row = [&](int i, std::size_t k) { return static_cast<double>(w[at(i)][k]); };
        both.full[at(r)][at(c)] += row(r, 0) * row(c, 1) + row(r, 1) * row(c, 0);
        for (std::size_t k = 2; k < 6; ++k) both.full[at(r)][at(c)] -= row(r, k) * row(c, k);
      }
    both.expect_equal(2e-5);
  }
}

TEST(BigCovariance, SparseRowsTimesP) {
  for (const int tail : {3, 5, 7}) {
    Both both(9);
    const std::array<std::array<float, 5>, 2> h{{{1.5F, -2.0F, 0.25F, 0.5F, 3.0F}, {0.1F, 0.2F, -1.0F, 2.0F, -0.7F}}};
    Covariance::Rows<4> product{};
    both.p.times<2, 3, 2>(h, tail, product, 1);
    for (int n = 0; n < 9; ++n)
      for (std::size_t r = 0; r < 2; ++r) {
        double expected = 0;
        for (int k = 0; k < 5; ++k)
          expected += static_cast<double>(h[r][at(k)]) * both.full[at(n)][at(k < 3 ? k : tail + k - 3)];
        EXPECT_NEAR(static_cast<double>(product[at(n)][1 + r]), expected, 1e-4) << tail << ": " << n;
      }
  }
}

TEST(BigCovariance, PredictsTheHeadAlone) {
  Both both(9);
  const std::array<std::array<float, 3>, 3> f{{{1, 0, -0.5F}, {0, 1, 2}, {0, 0, 1}}};
  const std::array<std::array<float, 3>, 3> q{{{0.1F, 0.02F, 0.03F}, {0, 0.2F, 0.01F}, {0, 0, 0.3F}}};
  both.p.predict_head<3>({f[0][2], f[1][2]}, q);
  Dense expected = both.full;
  const auto whole = [&](int r, int c) {
    return r < 3 && c < 3 ? static_cast<double>(f[at(r)][at(c)]) : r == c ? 1.0 : 0.0;
  };
  for (int r = 0; r < 9; ++r)
    for (int c = 0; c < 9; ++c) {
      expected[at(r)][at(c)] = r < 3 && c < 3 ? static_cast<double>(q[at(std::min(r, c))][at(std::max(r, c))]) : 0;
      for (int i = 0; i < 9; ++i)
        for (int j = 0; j < 9; ++j) expected[at(r)][at(c)] += whole(r, i) * both.full[at(i)][at(j)] * whole(c, j);
    }
  both.full = expected;
  both.expect_equal(1e-4);
}

TEST(BigCovariance, TurnsPairs) {
  Both both(9);
  const float c = std::cos(0.7F), s = std::sin(0.7F);
  both.p.turn_pairs(3, c, s);
  Dense expected = both.full;
  const auto whole = [&](int r, int k) -> double {
    if (r < 3) return r == k ? 1 : 0;
    const int pair = 3 + (r - 3) / 2 * 2;
    if (k != pair && k != pair + 1) return 0;
    if (r == k) return static_cast<double>(c);
    return static_cast<double>(r == pair ? -s : s);
  };
  for (int r = 0; r < 9; ++r)
    for (int k = 0; k < 9; ++k) {
      expected[at(r)][at(k)] = 0;
      for (int i = 0; i < 9; ++i)
        for (int j = 0; j < 9; ++j) expected[at(r)][at(k)] += whole(r, i) * both.full[at(i)][at(j)] * whole(k, j);
    }
  both.full = expected;
  both.expect_equal(1e-4);
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

TEST(BigCovariance, CopiedErrorsAreTheSameErrors) {
  Both both(10);
  both.p.copy(1, 6, 3);
  for (int r = 0; r < 10; ++r)
    for (int c = 0; c < 10; ++c) {
      const auto from = [](int i) { return i >= 6 && i < 9 ? i - 5 : i; };
      EXPECT_EQ(static_cast<double>(both.p(r, c)), both.full[at(from(r))][at(from(c))]) << r << "," << c;
    }
}

TEST(BigCovariance, AShareOfAnErrorIsAShear) {
  for (const auto& [to, from] : {std::pair(7, 2), std::pair(2, 7)}) {
    Both both(9);
    both.p.add_share(to, -1.5F, from);
    for (int n = 0; n < 9; ++n) both.full[at(to)][at(n)] += -1.5 * both.full[at(from)][at(n)];
    for (int n = 0; n < 9; ++n) both.full[at(n)][at(to)] += -1.5 * both.full[at(n)][at(from)];
    both.expect_equal(1e-4);
  }
}

TEST(BigCovariance, ProductsAreTakenOffAndAVarianceStaysAboveItsRounding) {
  for (const int n : {8, 9}) {
    Both both(n);
    Covariance::Rows<6> g{};
    for (auto& row : g)
      for (float& value : row) value = 0.1F * both.normal(both.random);
    both.p.subtract<3>(g, 2);
    for (int r = 0; r < n; ++r)
      for (int c = 0; c < n; ++c)
        for (std::size_t k = 2; k < 5; ++k)
          both.full[at(r)][at(c)] -= static_cast<double>(g[at(r)][k]) * static_cast<double>(g[at(c)][k]);
    both.expect_equal(1e-4);
  }
  Covariance p;
  Covariance::States ones{};
  ones.fill(1.0F);
  p.begin(ones);
  EXPECT_EQ(p.size(), kMost);
  Covariance::Rows<3> whole{};
  whole[4][1] = 1.0F;
  p.subtract<3>(whole, 0);
  EXPECT_GT(p(4, 4), 0.0F);
  EXPECT_LT(p(4, 4), 1e-6F);
  EXPECT_EQ(p(3, 3), 1.0F);
}

}  // namespace
}  // namespace tetap
