// SPDX-License-Identifier: Apache-2.0
// A filter that is looked at keeps its bits, and shows what it does: held against Eigen in double.
#include "tetap/filter/viewed.hpp"

#include "tetap/filter/kalman.hpp"
#include "tetap/model/zero_velocity.hpp"
#include "tetap/nav/ins.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include <algorithm>
#include <random>
#include <string>
#include <type_traits>
#include <vector>

namespace tetap {
namespace {

struct Seen {
  std::string model;
  std::vector<double> moved, prior, posterior, h, noise, nu, s;
  filter::Verdict verdict;
};
std::vector<Seen> seen;

using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
Rows rows(const std::vector<double>& values, std::size_t count) {
  return Eigen::Map<const Rows>(values.data(), static_cast<Eigen::Index>(count),
                                static_cast<Eigen::Index>(values.size() / count));
}

/// S, K nu and P+ of what was shown, to `share` of the prior's sigmas.
void holds(const Seen& update, double share) {
  const std::size_t m = update.nu.size(), n = update.moved.size();
  const Rows h = rows(update.h, m), p = rows(update.prior, n), s = rows(update.s, m), nu = rows(update.nu, m);
  Rows expected = h * p * h.transpose();
  for (std::size_t i = 0; i < m; ++i) expected(static_cast<long>(i), static_cast<long>(i)) += update.noise[i];
  EXPECT_LT((expected - s).cwiseAbs().maxCoeff(), 1e-5 * s.cwiseAbs().maxCoeff());
  const Rows k = p * h.transpose() * expected.inverse(), after = p - k * expected * k.transpose(), dx = k * nu;
  const bool accepted = update.verdict == filter::Verdict::kAccepted;
  const Rows posterior = rows(update.posterior, n), moved = rows(update.moved, n);
  for (long r = 0; r < p.rows(); ++r) {
    const double sigma = std::sqrt(p(r, r));
    EXPECT_NEAR(moved(r, 0), accepted ? dx(r, 0) : 0.0, share * sigma) << r;
    for (long c = 0; c < p.cols(); ++c)
      EXPECT_NEAR(posterior(r, c), accepted ? after(r, c) : p(r, c), share * sigma * std::sqrt(p(c, c))) << r << c;
  }
}

TEST(Viewed, IsTheFilterItselfInAnImage) {
  EXPECT_TRUE((std::is_same_v<filter::Viewable<nav::Ins>, nav::Ins>));
  EXPECT_EQ(sizeof(filter::Viewed<nav::Ins>), sizeof(nav::Ins));
}

TEST(Viewed, KeepsTheBitsOfTheLinearFilterAndShowsItsUpdates) {
  filter::Kalman<float, 2> plain;
  plain.p = filter::Symmetric<float, 2>::diagonal({10, 10});
  filter::Viewed<filter::Kalman<float, 2>> viewed;
  viewed.p = plain.p;
  filter::LinearMotion<float, 2> motion;
  motion.f(0, 1) = 0.1F;
  motion.q = filter::Symmetric<float, 2>::diagonal({0.001F, 0.001F});
  std::mt19937 draw(3);
  std::normal_distribution<float> noise(0, 0.7F);
  seen.clear();
  std::size_t refused = 0;
  for (int i = 0; i < 200; ++i) {
    const filter::DirectMeasurement<float, 2, 0> z{.z = filter::Vector<float, 1>(noise(draw)),
                                                   .variance = filter::Vector<float, 1>(0.5F)};
    ASSERT_TRUE(plain.predict(motion) && viewed.predict(motion));
    const auto a = plain.update(z, 2.0F), b = viewed.update(z, 2.0F);
    ASSERT_EQ(a.nis, b.nis);
    ASSERT_TRUE(plain.x.value == viewed.x.value && plain.p.packed() == viewed.p.packed());
    refused += a.verdict == filter::Verdict::kRejected ? 1 : 0;
  }
  ASSERT_EQ(seen.size(), 200U);
  EXPECT_GT(refused, 5U);
  for (const Seen& one : seen) holds(one, 1e-5);
  EXPECT_EQ(seen.front().model, "DirectMeasurement");
  EXPECT_NEAR(seen.front().prior.front(), 10.101, 1e-5);
}

TEST(Viewed, TheNavigationFilterIsShownWithItsCovarianceUpToDate) {
  nav::Ins plain;
  filter::Viewed<nav::Ins> viewed;
  const auto imu = nav::ImuIncrement::constant({0.01F, -0.02F, 0.1F}, {0.2F, 0.1F, 9.81F}, {10'000});
  seen.clear();
  for (int i = 0; i < 50; ++i) {
    ASSERT_EQ(plain.predict(imu), viewed.predict(imu));
    if (i % 5 != 4) continue;  // the update brings the covariance to the state's time
    const model::ZeroVelocity rest{.sigma_mps = 0.05F};
    static_cast<void>(plain.update(rest, 1e9F));
    static_cast<void>(viewed.update(rest, 1e9F));
    ASSERT_TRUE(plain.p.packed() == viewed.p.packed());
    ASSERT_TRUE(plain.x.v_n_mps == viewed.x.v_n_mps && plain.x.b_a_mps2 == viewed.x.b_a_mps2);
  }
  ASSERT_EQ(seen.size(), 10U);
  EXPECT_EQ(seen.back().model, "ZeroVelocity");
  for (const Seen& one : seen) holds(one, 2e-3);
}

}  // namespace
}  // namespace tetap

/// This program's own.
void tetap::filter::view(const UpdateView& update) {
  const auto copy = [](std::span<const float> values) { return std::vector<double>(values.begin(), values.end()); };
  seen.push_back({.model = std::string(update.model),
                  .moved = copy(update.moved),
                  .prior = copy(update.prior),
                  .posterior = copy(update.posterior),
                  .h = copy(update.h),
                  .noise = copy(update.noise),
                  .nu = copy(update.nu),
                  .s = copy(update.s),
                  .verdict = update.verdict});
}
