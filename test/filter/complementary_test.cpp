// SPDX-License-Identifier: Apache-2.0
// The one-axis complementary filter: the two halves are one whole, whatever the signal and the intervals.
#include "tetap/filter/complementary.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace tetap::filter {
namespace {

TEST(Complementary, high_pass_and_low_pass_sum_to_the_input) {
  std::mt19937 engine(1);
  std::uniform_real_distribution<float> value(-100.0F, 100.0F), interval(1e-4F, 2.0F);
  for (const float tau_s : {0.01F, 0.3F, 1.0F, 50.0F}) {
    FirstOrderLowPass low;
    FirstOrderHighPass high;
    for (int k = 0; k < 10'000; ++k) {
      const float x = value(engine), alpha = complementary_weight(tau_s, interval(engine));
      const float h = high.step(x, alpha), l = low.step(x, alpha);
      // The high-pass starts at zero and the low-pass at the input, so the sum is the input from the first sample.
      ASSERT_NEAR(h + l, x, 1e-3F) << tau_s << ' ' << k;
    }
  }
}

TEST(Complementary, both_have_the_gain_of_their_transfer_functions) {
  constexpr float kStep_s = 1e-3F;
  constexpr double kTau_s = 0.5;
  for (const double ratio : {0.1, 1.0, 10.0}) {
    const double w = ratio / kTau_s;
    const float alpha = complementary_weight(static_cast<float>(kTau_s), kStep_s);
    FirstOrderLowPass low;
    FirstOrderHighPass high;
    double low_peak = 0, high_peak = 0;
    for (int k = 0; k < 100'000; ++k) {
      const auto x = static_cast<float>(std::sin(w * k * static_cast<double>(kStep_s)));
      const float l = low.step(x, alpha), h = high.step(x, alpha);
      if (k < 50'000) continue;
      low_peak = std::max(low_peak, std::abs(static_cast<double>(l)));
      high_peak = std::max(high_peak, std::abs(static_cast<double>(h)));
    }
    EXPECT_NEAR(low_peak, 1.0 / std::hypot(1.0, ratio), 0.012) << ratio;
    EXPECT_NEAR(high_peak, ratio / std::hypot(1.0, ratio), 0.012) << ratio;
  }
}

TEST(Complementary, weight_is_tau_over_tau_plus_dt) {
  EXPECT_FLOAT_EQ(complementary_weight(0.98F, 0.02F), 0.98F);
  EXPECT_FLOAT_EQ(complementary_weight(1.0F, 1.0F), 0.5F);
  EXPECT_EQ(complementary_weight(0.0F, 0.01F), 0.0F);
  EXPECT_EQ(complementary_weight(1.0F, std::numeric_limits<float>::infinity()), 0.0F);
  EXPECT_EQ(complementary_weight(NAN, 0.01F), 0.0F);
}

TEST(Complementary, angle_is_the_low_passed_measurement_plus_the_high_passed_integral) {
  constexpr float kStep_s = 0.01F, kTau_s = 0.7F;
  ComplementaryAngle angle(kTau_s);
  FirstOrderLowPass low;
  FirstOrderHighPass high;
  std::mt19937 engine(4);
  std::normal_distribution<float> noise(0.0F, 0.05F);
  const float alpha = complementary_weight(kTau_s, kStep_s);
  float integral = 0.0F;
  for (int k = 0; k < 5000; ++k) {
    const float t_s = kStep_s * static_cast<float>(k);
    const float rate = k == 0 ? 0.0F : 0.5F * std::cos(t_s) + 0.02F;
    const float measured = 0.5F * std::sin(t_s) + noise(engine);
    integral += rate * kStep_s;
    ASSERT_TRUE(angle.step(rate, measured, kStep_s));
    ASSERT_NEAR(angle.angle_rad(), low.step(measured, alpha) + high.step(integral, alpha), 2e-4F) << k;
  }
}

TEST(Complementary, angle_crosses_the_half_turn_the_short_way) {
  ComplementaryAngle angle(1.0F);
  ASSERT_TRUE(angle.step(0.0F, 3.1F, 0.01F));
  float truth = 3.1F;
  for (int k = 0; k < 2000; ++k) {
    truth += 0.01F;
    const float noise = k % 2 == 0 ? 0.02F : -0.02F;  // measurement and angle cross in different samples
    ASSERT_TRUE(angle.step(1.0F, base::wrap_angle(truth + noise), 0.01F));
    ASSERT_LT(std::abs(base::wrap_angle(angle.angle_rad() - truth)), 1e-3F);
  }
}

TEST(Complementary, scales_with_time) {
  ComplementaryAngle fast(0.5F), slow(1.0F);
  for (int k = 0; k < 1000; ++k) {
    const float rate = std::sin(0.1F * static_cast<float>(k)),
                measured = 0.3F * std::cos(0.07F * static_cast<float>(k));
    ASSERT_TRUE(fast.step(rate, measured, 0.0078125F));
    ASSERT_TRUE(slow.step(0.5F * rate, measured, 0.015625F));
    ASSERT_EQ(base::bits(fast.angle_rad()), base::bits(slow.angle_rad()));
  }
}

TEST(Complementary, refuses_what_is_no_number_and_keeps_its_angle) {
  ComplementaryAngle angle(1.0F);
  ASSERT_TRUE(angle.step(0.0F, 0.4F, 0.01F));
  for (const float bad : {NAN, INFINITY, -INFINITY}) {
    EXPECT_FALSE(angle.step(bad, 0.0F, 0.01F));
    EXPECT_FALSE(angle.step(0.0F, bad, 0.01F));
    EXPECT_FALSE(angle.step(0.0F, 0.0F, bad));
  }
  EXPECT_FALSE(angle.step(0.0F, 0.0F, 0.0F));
  EXPECT_FALSE(angle.step(0.0F, 0.0F, -0.01F));
  EXPECT_FALSE(angle.step(3e38F, 0.0F, 0.01F));
  EXPECT_EQ(angle.angle_rad(), 0.4F);
}

}  // namespace
}  // namespace tetap::filter
