// SPDX-License-Identifier: Apache-2.0
// Increments against a strapdown integration in double at a hundred times the rate.
#include "drivers/imu/integration.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>

namespace tetap::drivers {
namespace {

using Double3 = std::array<double, 3>;
using Quaternion = std::array<double, 4>;
using Motion = std::function<Double3(double)>;

Double3 cross(const Double3& a, const Double3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
Quaternion multiply(const Quaternion& p, const Quaternion& q) {
  return {p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3], p[0] * q[1] + p[1] * q[0] + p[2] * q[3] - p[3] * q[2],
          p[0] * q[2] - p[1] * q[3] + p[2] * q[0] + p[3] * q[1], p[0] * q[3] + p[1] * q[2] - p[2] * q[1] + p[3] * q[0]};
}
Quaternion exponential(const Double3& v) {
  const double angle = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
  const double s = angle < 1e-12 ? 0.5 : std::sin(angle / 2) / angle;
  return {std::cos(angle / 2), s * v[0], s * v[1], s * v[2]};
}
Double3 rotate(const Quaternion& q, const Double3& v) {
  const Double3 u{q[1], q[2], q[3]};
  const Double3 t = cross(u, v);
  const Double3 w = cross(u, t);
  return {v[0] + 2 * (q[0] * t[0] + w[0]), v[1] + 2 * (q[0] * t[1] + w[1]), v[2] + 2 * (q[0] * t[2] + w[2])};
}
double angle_between(const Quaternion& p, const Quaternion& q) {
  const Quaternion d = multiply({p[0], -p[1], -p[2], -p[3]}, q);
  return 2 * std::sqrt(d[1] * d[1] + d[2] * d[2] + d[3] * d[3]);
}

struct Errors {
  double attitude_rad = 0;
  double velocity_mps = 0;
};

/// Attitude and velocity after `seconds`, from increments of `readings` samples at `rate_Hz`, less the truth. With
/// `corrected` off: sums alone, as if nothing turned meanwhile.
Errors integrate(const Motion& rate, const Motion& force, double seconds, double rate_Hz, int readings,
                 bool corrected) {
  Quaternion truth{1, 0, 0, 0}, sum{1, 0, 0, 0};
  Double3 v_truth{}, v_sum{}, alpha{}, v_step{};
  ImuIntegrator integrator(static_cast<std::uint8_t>(readings));
  const auto as_float = [](const Double3& v) {
    return Vector3{static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
  };
  const auto interval_us = static_cast<std::int64_t>(1e6 / rate_Hz);
  const double dt = 1e-6 * static_cast<double>(interval_us);
  constexpr int kFine = 100;
  Double3 rate_before = rate(0), force_before = force(0);
  // A first reading, whose interval nobody asks for.
  static_cast<void>(integrator.add({.stamp = {0},
                                    .interval = {0},
                                    .rate_b_radps = as_float(rate(0)),
                                    .force_b_mps2 = as_float(force(0)),
                                    .after_gap = true}));
  // The first reading is one of the first increment.
  const int steps = static_cast<int>(seconds / dt) / readings * readings - 1;
  for (int k = 1; k <= steps; ++k) {
    for (int j = 0; j < kFine; ++j) {
      const double t = (k - 1) * dt + (j + 0.5) * dt / kFine;
      const double h = dt / kFine;
      const Double3 w = rate(t), f = force(t);
      const Quaternion half = multiply(truth, exponential({w[0] * h / 2, w[1] * h / 2, w[2] * h / 2}));
      const Double3 f_n = rotate(half, f);
      for (std::size_t i = 0; i < 3; ++i) v_truth[i] += f_n[i] * h;
      truth = multiply(truth, exponential({w[0] * h, w[1] * h, w[2] * h}));
    }
    const Double3 w = rate(k * dt), f = force(k * dt);
    for (std::size_t i = 0; i < 3; ++i) {
      alpha[i] += 0.5 * dt * (w[i] + rate_before[i]);
      v_step[i] += 0.5 * dt * (f[i] + force_before[i]);
    }
    rate_before = w;
    force_before = f;
    const auto out = integrator.add({.stamp = {k * interval_us},
                                     .interval = {interval_us},
                                     .rate_b_radps = as_float(w),
                                     .force_b_mps2 = as_float(f)});
    if (!out) continue;
    if (corrected) {
      const auto& dv = out->sample.dvelocity_b_mps;
      const auto& da = out->sample.dangle_b_rad;
      const Double3 dv_n =
          rotate(sum, {static_cast<double>(dv[0]), static_cast<double>(dv[1]), static_cast<double>(dv[2])});
      for (std::size_t i = 0; i < 3; ++i) v_sum[i] += dv_n[i];
      sum = multiply(sum,
                     exponential({static_cast<double>(da[0]), static_cast<double>(da[1]), static_cast<double>(da[2])}));
    } else {
      const Double3 dv_n = rotate(sum, v_step);
      for (std::size_t i = 0; i < 3; ++i) v_sum[i] += dv_n[i];
      sum = multiply(sum, exponential(alpha));
    }
    alpha = v_step = {};
  }
  Errors errors{.attitude_rad = angle_between(truth, sum)};
  for (std::size_t i = 0; i < 3; ++i) errors.velocity_mps += (v_sum[i] - v_truth[i]) * (v_sum[i] - v_truth[i]);
  errors.velocity_mps = std::sqrt(errors.velocity_mps);
  return errors;
}

// The classic: the axis of rotation runs round a cone at 10 Hz, half angle 1 deg; the body's rates are two sines.
Motion coning(double half_angle_rad, double Hz) {
  return [=](double t) {
    const double w = 2 * 3.14159265358979 * Hz;
    return Double3{w * half_angle_rad * std::cos(w * t), w * half_angle_rad * std::sin(w * t), 0};
  };
}

TEST(ImuIntegrator, ConingDriftIsRemoved) {
  const Motion still = [](double) { return Double3{}; };
  const Motion cone = coning(0.02, 10);
  const Errors ctx = integrate(cone, still, 10.0, 1000, 20, true);
  const Errors without = integrate(cone, still, 10.0, 1000, 20, false);
  EXPECT_GT(without.attitude_rad, 0.01);
  EXPECT_LT(ctx.attitude_rad, without.attitude_rad / 50);
}

TEST(ImuIntegrator, ScullingDriftIsRemoved) {
  // Rotation about x and force along y, in step: what they rectify points along z.
  const double w = 2 * 3.14159265358979 * 10;
  const Motion rate = [=](double t) { return Double3{0.02 * w * std::cos(w * t), 0, 0}; };
  const Motion force = [=](double t) { return Double3{0, 5 * std::sin(w * t), 0}; };
  const Errors ctx = integrate(rate, force, 10.0, 1000, 20, true);
  const Errors without = integrate(rate, force, 10.0, 1000, 20, false);
  EXPECT_GT(without.velocity_mps, 0.03);
  EXPECT_LT(ctx.velocity_mps, without.velocity_mps / 50);
}

TEST(ImuIntegrator, ASteadyTurnUnderSteadyForceIsExactToSecondOrder) {
  const Motion rate = [](double) { return Double3{0.4, -0.8, 1.5}; };
  const Motion force = [](double) { return Double3{3, -2, 9.8}; };
  const Errors fine = integrate(rate, force, 4.0, 1000, 5, true);
  EXPECT_LT(fine.attitude_rad, 5e-6);
  EXPECT_LT(fine.velocity_mps, 1e-4);
  EXPECT_GT(integrate(rate, force, 4.0, 1000, 5, false).velocity_mps, 0.003);
}

TEST(ImuIntegrator, RoughMotionComesOutRightForEveryLengthOfTheInterval) {
  const Motion rate = [](double t) {
    return Double3{std::sin(19 * t), 1.3 * std::cos(23 * t + 1), 0.7 * std::sin(29 * t) + 0.5};
  };
  const Motion force = [](double t) {
    return Double3{4 * std::sin(17 * t), 3 * std::cos(27 * t), 9.8 + 2 * std::sin(31 * t)};
  };
  for (const int readings : {1, 2, 5, 10}) {
    const Errors errors = integrate(rate, force, 10.0, 1000, readings, true);
    EXPECT_LT(errors.attitude_rad, 2e-4) << readings;
    EXPECT_LT(errors.velocity_mps, 5e-3) << readings;
  }
}

TEST(ImuIntegrator, IntervalsAddUpToTimeAndEndAtTheLastStamp) {
  ImuIntegrator integrator(4);
  std::int64_t covered = 0;
  std::int64_t stamp = 0;
  for (int k = 1; k <= 100; ++k) {
    const std::int64_t interval = 1000 + k % 3;
    stamp += interval;
    const auto out =
        integrator.add({.stamp = {stamp}, .interval = {interval}, .temperature_degC = 20, .after_gap = k == 1});
    EXPECT_EQ(out.has_value(), k % 4 == 0);
    if (!out) continue;
    covered += out->sample.interval_us;
    EXPECT_EQ(out->stamp.us, stamp);
    EXPECT_EQ(covered, stamp);
    EXPECT_FLOAT_EQ(out->sample.temperature_degC, 20);
  }
}

TEST(ImuIntegrator, NeverLongerThanASampleCanSay) {
  ImuIntegrator integrator(200);
  std::int64_t covered = 0;
  for (int k = 1; k <= 50; ++k) {
    const auto out = integrator.add({.stamp = {k * 20'000}, .interval = {20'000}, .after_gap = k == 1});
    if (out) {
      covered += out->sample.interval_us;
      EXPECT_EQ(covered, out->stamp.us);
    }
  }
  EXPECT_GE(covered, 900'000);
}

TEST(ImuIntegrator, AGapEndsTheIncrementBeforeItAndIsSeenInTheStamps) {
  ImuIntegrator integrator(4);
  std::optional<StampedImu> out;
  for (int k = 1; k <= 6; ++k)
    out = integrator.add({.stamp = {k * 1000}, .interval = {1000}, .rate_b_radps = {1, 0, 0}, .after_gap = k == 1});
  EXPECT_FALSE(out);
  out = integrator.add({.stamp = {50'000}, .interval = {1000}, .rate_b_radps = {5, 0, 0}, .after_gap = true});
  ASSERT_TRUE(out);
  EXPECT_EQ(out->stamp.us, 6000);
  EXPECT_EQ(out->sample.interval_us, 2000);
  EXPECT_FLOAT_EQ(out->sample.dangle_b_rad[0], 0.002F);
  for (int k = 51; k <= 53; ++k)
    out = integrator.add({.stamp = {k * 1000}, .interval = {1000}, .rate_b_radps = {5, 0, 0}});
  ASSERT_TRUE(out);
  EXPECT_EQ(out->stamp.us - out->sample.interval_us, 49'000);
  EXPECT_FLOAT_EQ(out->sample.dangle_b_rad[0], 0.02F) << "nothing of the rate before the gap";
}

TEST(ImuIntegrator, ClippedReadingsAreCountedPerIncrement) {
  ImuIntegrator integrator(3);
  std::optional<StampedImu> out;
  for (int k = 1; k <= 3; ++k)
    out = integrator.add({.interval = {1000}, .clipped_gyro = k == 2, .clipped_accel = k > 1});
  ASSERT_TRUE(out);
  EXPECT_EQ(out->sample.clipped_gyro, 1);
  EXPECT_EQ(out->sample.clipped_accel, 2);
  for (int k = 1; k <= 3; ++k) out = integrator.add({.interval = {1000}});
  EXPECT_EQ(out->sample.clipped_gyro + out->sample.clipped_accel, 0);
}

}  // namespace
}  // namespace tetap::drivers
