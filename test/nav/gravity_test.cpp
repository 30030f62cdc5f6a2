// SPDX-License-Identifier: Apache-2.0
// Judged by the values published for WGS84 (NIMA TR8350.2, 3rd ed., table 3.4).
#include "tetap/nav/gravity.hpp"

#include <gtest/gtest.h>
#include <cmath>

namespace tetap {
namespace {

TEST(Gravity, IsThePublishedAtEquatorAndPole) {
  EXPECT_NEAR(nav::normal_gravity(0.0, 0.0), 9.7803253359, 1e-10);
  EXPECT_NEAR(nav::normal_gravity(M_PI / 2, 0.0), 9.8321849378, 2e-10);
  EXPECT_NEAR(nav::normal_gravity(-M_PI / 2, 0.0), 9.8321849378, 2e-10);
}

TEST(Gravity, AveragesOverTheEllipsoidToThePublishedMean) {
  // Area element of the ellipsoid: M N cos(latitude) dlatitude.
  double weighted = 0, area = 0;
  constexpr int kSteps = 20'000;
  for (int i = 0; i < kSteps; ++i) {
    const double latitude = (i + 0.5) / kSteps * M_PI / 2;
    const double w2 = 1 - base::kEccentricity2 * std::sin(latitude) * std::sin(latitude);
    const double element = std::cos(latitude) / (w2 * w2);
    weighted += element * nav::normal_gravity(latitude, 0.0);
    area += element;
  }
  EXPECT_NEAR(weighted / area, 9.7976432222, 1e-9);
}

TEST(Gravity, FallsWithHeightAsTheFreeAirGradientSays) {
  // -2 gamma/a (1 + f + m - 2 f sin^2) by hand: 3.0877e-6 per second squared at the equator, 3.0834e-6 at the pole.
  EXPECT_NEAR(nav::normal_gravity(0.0, 0.0) - nav::normal_gravity(0.0, 1.0), 3.0877e-6, 5e-10);
  EXPECT_NEAR(nav::normal_gravity(M_PI / 2, 0.0) - nav::normal_gravity(M_PI / 2, 1.0), 3.0834e-6, 5e-10);
  EXPECT_GT(nav::normal_gravity(0.8, -400.0), nav::normal_gravity(0.8, 0.0));
}

TEST(Gravity, EarthTurnsAboutTheNorthPoleSeenFromEverywhere) {
  const auto at = [](double latitude_deg) {
    return nav::Earth::at(nav::LocalFrame(static_cast<std::int64_t>(latitude_deg * 5e8), 0, 0.0F), true);
  };
  EXPECT_NEAR(at(90).rate_n_radps(2), 7.292115e-5F, 1e-11F);
  EXPECT_NEAR(at(0).rate_n_radps(1), 7.292115e-5F, 1e-11F);
  EXPECT_NEAR(at(-30).rate_n_radps(2), -7.292115e-5F / 2, 1e-11F);
  EXPECT_NEAR(at(48).rate_n_radps.norm(), 7.292115e-5F, 1e-11F);
  EXPECT_FALSE(nav::Earth::at(nav::LocalFrame(1, 2, 3.0F), false).rotates());
  EXPECT_TRUE(at(0).rotates());
}

}  // namespace
}  // namespace tetap
