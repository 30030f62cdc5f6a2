// SPDX-License-Identifier: Apache-2.0
// What a wrong scale of the gyroscope costs the heading, against what it does: error = scale times the angle turned.
#include "nav/turned_scale.hpp"

#include <gtest/gtest.h>
#include <cmath>
#include <functional>

namespace tetap {
namespace {

constexpr float kScale = 0.003F;

/// One sigma of the heading, in units of scale times one radian, after turning as `rate` says.
double sigma_after(double duration_s, double dt_s, const std::function<double(double)>& rate_radps) {
  nav::TurnedScale scale;
  double variance = 0;
  for (double t = 0; t < duration_s; t += dt_s)
    variance += static_cast<double>(scale.turn(static_cast<float>(rate_radps(t) * dt_s), kScale));
  return std::sqrt(variance) / static_cast<double>(kScale);
}

TEST(TurnedScale, ACornerAndACircleCostWhatTheyDoAtAnyRateAndCadence) {
  for (const double dt_s : {0.0025, 0.005, 0.02})
    for (const double rate : {-1.0, 0.06, 0.3}) {
      for (const double angle : {1.5707963, 6.2831853})
        EXPECT_NEAR(sigma_after(angle / std::abs(rate), dt_s, [&](double) { return rate; }), angle, 0.03) << rate;
    }
}

TEST(TurnedScale, WeavingAndNoiseCostLittle) {
  // 0.3 rad/s at 0.5 Hz for ten minutes: 0.1 rad to either side. What it does is 0.1.
  EXPECT_LT(sigma_after(600, 0.01, [](double t) { return 0.3 * std::cos(3.14159265 * t); }), 4.0);
  EXPECT_EQ(sigma_after(3600, 0.01, [](double t) { return std::lround(t / 0.01) % 2 == 0 ? 0.5 : -0.5; }), 0.0);
}

/// Less than it does: receivers tell a heading on the way.
TEST(TurnedScale, EveryFurtherCircleCostsMoreThanOneAndLessThanTheSum) {
  const double ten = sigma_after(62.831853, 0.01, [](double) { return 1.0; }) / 6.2831853;
  EXPECT_GT(ten, std::sqrt(10.0));
  EXPECT_LT(ten, 10.0);
}

TEST(TurnedScale, WhatIsToldAheadIsWhatItWillCost) {
  nav::TurnedScale scale;
  static_cast<void>(scale.turn(0.5F, kScale));
  const float ahead = scale.would_add(0.2F, kScale);
  EXPECT_GT(ahead, 0.0F);
  EXPECT_FLOAT_EQ(scale.turn(0.2F, kScale), ahead);
  EXPECT_EQ(scale.would_add(-0.3F, kScale), 0.0F) << "back";
}

}  // namespace
}  // namespace tetap
