// SPDX-License-Identifier: Apache-2.0
// Cost of a wrong scale of the gyroscope to the heading, against its effect: error = scale times the angle turned.
#include "tetap/nav/gyro_scale_consider.hpp"

#include <gtest/gtest.h>
#include <cmath>
#include <functional>
#include <vector>

namespace tetap {
namespace {

constexpr float kScale = 0.003F;

/// One sigma of the heading, in units of scale times one radian, after turning as `rate` says.
double sigma_after(double duration_s, double dt_s, const std::function<double(double)>& rate_radps) {
  nav::GyroScaleConsider scale;
  double variance = 0;
  for (double t = 0; t < duration_s; t += dt_s)
    variance += static_cast<double>(scale.turn(static_cast<float>(rate_radps(t) * dt_s), kScale));
  return std::sqrt(variance) / static_cast<double>(kScale);
}

TEST(GyroScaleConsider, ACornerAndACircleCostWhatTheyDoAtAnyRateAndCadence) {
  for (const double dt_s : {0.0025, 0.005, 0.02})
    for (const double rate : {-1.0, 0.06, 0.3}) {
      for (const double angle : {1.5707963, 6.2831853})
        EXPECT_NEAR(sigma_after(angle / std::abs(rate), dt_s, [&](double) { return rate; }), angle, 0.03) << rate;
    }
}

TEST(GyroScaleConsider, WeavingAndNoiseCostLittle) {
  // 0.3 rad/s at 0.5 Hz for ten minutes: 0.1 rad to either side. The wrong scale's effect is 0.1.
  EXPECT_LT(sigma_after(600, 0.01, [](double t) { return 0.3 * std::cos(3.14159265 * t); }), 0.2);
  EXPECT_EQ(sigma_after(3600, 0.01, [](double t) { return std::lround(t / 0.01) % 2 == 0 ? 0.5 : -0.5; }), 0.0);
}

TEST(GyroScaleConsider, TenCirclesCostTenTimesOne) {
  EXPECT_NEAR(sigma_after(62.831853, 0.01, [](double) { return 1.0; }) / 6.2831853, 10.0, 0.01);
}

/// Variance of the heading with the scale as a state that is never corrected. Two states, written out, with the gain of
/// the filter. Joseph's form, because the gain may be another than the best.
struct Considered {
  double p = 0, c = 0;
  void turn(double by, double scale) {
    p += by * (2 * c + scale * scale * by);
    c += scale * scale * by;
  }
  void measured(double r, double left) {
    p = left * left * p + (1 - left) * (1 - left) * r;
    c *= left;
  }
};

/// A circle, the heading told, the circle back: the way back is wrong by the scale as the way there was.
TEST(GyroScaleConsider, TurnsAndWhatIsToldOfTheHeadingAreThoseOfAConsideredScale) {
  constexpr double kS = static_cast<double>(kScale);
  struct Leg {
    double turn_rad;
    double heading_rad2;  ///< variance of a heading told after it; 0: none is
  };
  const std::vector<std::vector<Leg>> drives{
      {{6.28, 1e-8}, {-6.28, 0}},
      {{6.28, 1e-4}, {-3.14, 0}, {-3.14, 1e-5}, {9.0, 0}},
      {{6.28, 0}, {-6.28, 1e-5}, {6.28, 0}},
      {{-1.5, 0}, {3.0, 1e-5}, {-3.0, 0}, {1.5, 0}, {25.0, 1e-5}, {-25.0, 0}},
  };
  for (const auto& drive : drives) {
    Considered law;
    nav::GyroScaleConsider scale;
    double variance = 0;
    for (const Leg& leg : drive) {
      for (int i = 0; i < 100; ++i) {
        law.turn(leg.turn_rad / 100, kS);
        variance += static_cast<double>(scale.turn(static_cast<float>(leg.turn_rad / 100), kScale));
      }
      if (leg.heading_rad2 > 0) {
        const double left = leg.heading_rad2 / (variance + leg.heading_rad2);
        law.measured(leg.heading_rad2, left);
        scale.heading_measured(static_cast<float>(left));
        variance *= left;
      }
      // P stays as it was on the way back. It is never too small, and at the end at most twice as large as it has to
      // be.
      EXPECT_GE(variance, 0.97 * law.p) << leg.turn_rad;
    }
    EXPECT_NEAR(variance, law.p, 0.05 * law.p);
  }
}

TEST(GyroScaleConsider, WhatIsToldAheadIsWhatItWillCost) {
  nav::GyroScaleConsider scale;
  static_cast<void>(scale.turn(0.5F, kScale));
  const float ahead = scale.would_add(0.2F, kScale);
  EXPECT_GT(ahead, 0.0F);
  EXPECT_FLOAT_EQ(scale.turn(0.2F, kScale), ahead);
  EXPECT_EQ(scale.would_add(-0.3F, kScale), 0.0F) << "back";
}

}  // namespace
}  // namespace tetap
