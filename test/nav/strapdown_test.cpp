// SPDX-License-Identifier: Apache-2.0
// Strapdown against motions whose course is known in closed form.
#include "tetap/nav/strapdown.hpp"

#include "true_body.hpp"

#include <gtest/gtest.h>

namespace tetap {
namespace {

using nav::Earth;
using nav::ImuIncrement;
using nav::InsState;
using nav::Vector3;

constexpr base::Micros k5ms{5'000};

TEST(Strapdown, FreeFallIsHalfGSquared) {
  InsState x;
  x.v_n_mps = {3, 0, 20};
  x.q_nb = nav::from_euler({.yaw_rad = 1, .pitch_rad = 0.4F, .roll_rad = -2});
  const Earth earth{.gravity_mps2 = 9.81F};
  for (int i = 0; i < 400; ++i)
    nav::strapdown(x, ImuIncrement::constant({0.3F, -0.2F, 2.0F}, Vector3::Zero(), k5ms), earth);
  EXPECT_NEAR(test::metres(x.x), 6.0, 2e-5);
  EXPECT_NEAR(test::metres(x.z), 40.0 - 9.81 * 2.0, 2e-4);
  EXPECT_NEAR(x.v_n_mps(2), 20.0F - 19.62F, 1e-4F);
}

TEST(Strapdown, AtRestNothingMovesWhateverTheAttitudeAndTheBiases) {
  for (const float roll : {0.0F, 0.7F, 3.0F}) {
    InsState x;
    x.q_nb = nav::from_euler({.yaw_rad = 2, .pitch_rad = -0.3F, .roll_rad = roll});
    x.b_a_mps2 = {0.1F, -0.2F, 0.3F};
    x.b_g_radps = {0.01F, 0.02F, -0.03F};
    const InsState begin = x;
    const Earth earth;
    const Vector3 f_b = x.q_nb.conjugate().rotate({0, 0, earth.gravity_mps2}) + x.b_a_mps2;
    for (int i = 0; i < 2000; ++i) nav::strapdown(x, ImuIncrement::constant(x.b_g_radps, f_b, k5ms), earth);
    const auto moved = x.minus(begin);
    EXPECT_LT(moved.head<3>().norm(), 3e-4F);
    EXPECT_LT(moved.segment<3>(3).norm(), 6e-5F);
    EXPECT_LT(moved.segment<3>(6).norm(), 5e-6F);
  }
}

/// Speed v on a circle of radius r, looking ahead: w = v/r up, f = (0, v^2/r, g). The increment of a span is exact, so
/// only the trapezoid of the position is left.
TEST(Strapdown, ACircleComesHomeAndTheErrorFallsWithTheSquareOfTheStep) {
  const double v = 10, r = 20, w = v / r;
  const auto gap = [&](int steps_per_turn) {
    const double dt = 2 * M_PI / w / steps_per_turn;
    const auto dt_us = static_cast<std::int64_t>(std::lround(dt * 1e6));
    const double dt_s = 1e-6 * static_cast<double>(dt_us);
    InsState x;
    x.v_n_mps = {10, 0, 0};
    const Earth earth;
    const Vector3 w_b{0, 0, static_cast<float>(w)};
    const Vector3 f_b{0, static_cast<float>(v * w), earth.gravity_mps2};
    double worst = 0;
    for (int i = 1; i <= steps_per_turn; ++i) {
      nav::strapdown(x, ImuIncrement::constant(w_b, f_b, {dt_us}), earth);
      const double a = w * dt_s * i;
      worst =
          std::max(worst, std::hypot(test::metres(x.x) - r * std::sin(a), test::metres(x.y) - r * (1 - std::cos(a))));
      EXPECT_NEAR(static_cast<double>(x.v_n_mps.norm()), v, 2e-3);
      EXPECT_NEAR(std::remainder(static_cast<double>(nav::euler(x.q_nb).yaw_rad) - a, 2 * M_PI), 0, 2e-5);
    }
    return worst;
  };
  // The polygon of chords, v dt^2 w v.. / 12 of the radius: (w dt)^2 / 12 * 2 r at the far side.
  EXPECT_NEAR(gap(126), 2 * r * std::pow(2 * M_PI / 126, 2) / 12, 1e-3);
  EXPECT_LT(gap(2513), 1.5e-3);
}

/// Coning: the axis of a rotation by `a` runs round a cone. Truth: q(t) = (cos(a/2), sin(a/2) cos wt, sin(a/2) sin wt,
/// 0). Against the sum of angles the body drifts about z by w (1 - cos a) per second. Increments whose coning is
/// counted do not drift.
TEST(Strapdown, ConingDoesNotDriftWhenSamplesAreJoinedAndDoesWhenTheyAreSummed) {
  const double a = 0.05, w = 2 * M_PI * 20;
  const auto truth = [&](double t) {
    return Eigen::Quaterniond(std::cos(a / 2), std::sin(a / 2) * std::cos(w * t), std::sin(a / 2) * std::sin(w * t), 0);
  };
  // A gyroscope that integrates over 0.25 ms.
  const auto sample = [&](int i) {
    const double h = 0.00025;
    return test::log_double(truth(h * i).conjugate() * truth(h * (i + 1)));
  };
  InsState joined, summed;
  joined.q_nb = summed.q_nb = test::as_float(truth(0));
  const Earth weightless{.gravity_mps2 = 0};
  constexpr int kPerStep = 20, kSteps = 2000;  // 5 ms, 10 s
  for (int i = 0; i < kSteps; ++i) {
    ImuIncrement one = test::increment(sample(i * kPerStep), {0, 0, 0}, 250);
    Vector3 sum = one.dtheta_b_rad;
    for (int k = 1; k < kPerStep; ++k) {
      const auto next = test::increment(sample(i * kPerStep + k), {0, 0, 0}, 250);
      one = one.then(next);
      sum += next.dtheta_b_rad;
    }
    nav::strapdown(joined, one, weightless);
    nav::strapdown(summed, {.dtheta_b_rad = sum, .dt = k5ms}, weightless);
  }
  const auto error = [&](const InsState& x) {
    return test::log_double(test::as_double(x.q_nb) * truth(kSteps * 0.005).conjugate()).norm();
  };
  EXPECT_LT(error(joined), 2e-4);
  EXPECT_GT(error(summed), 0.01) << "otherwise this motion shows nothing";
}

/// Sculling: rotation about x and acceleration along y, in phase. The mean of f_n along z is what summed samples lose.
TEST(Strapdown, ScullingDoesNotDriftWhenSamplesAreJoined) {
  const double a = 0.02, acc = 5, w = 2 * M_PI * 30, h = 0.0005;
  InsState x;
  const Earth weightless{.gravity_mps2 = 0};
  double vz = 0;
  for (int i = 0; i < 1000; ++i) {
    ImuIncrement one;
    for (int k = 0; k < 10; ++k) {
      const double t0 = h * (i * 10 + k), t1 = t0 + h;
      const Vector3 dtheta{static_cast<float>(a * (std::sin(w * t1) - std::sin(w * t0))), 0, 0};
      Eigen::Vector3d dv_n = Eigen::Vector3d::Zero();
      for (int m = 0; m < 50; ++m) {  // f along body y, amplitude acc, in phase with the angle
        const double t = t0 + h * (m + 0.5) / 50, angle = a * std::sin(w * t), f = acc * std::sin(w * t);
        dv_n += h / 50 * f * Eigen::Vector3d(0, std::cos(angle), std::sin(angle));
      }
      vz += dv_n(2);
      const Eigen::Vector3d dv_b = Eigen::AngleAxisd(-a * std::sin(w * t0), Eigen::Vector3d::UnitX()) * dv_n;
      const ImuIncrement part{.dtheta_b_rad = dtheta, .dv_b_mps = dv_b.cast<float>(), .dt = {500}};
      one = k == 0 ? part : one.then(part);
    }
    nav::strapdown(x, one, weightless);
  }
  EXPECT_GT(vz, 0.2);
  EXPECT_NEAR(static_cast<double>(x.v_n_mps(2)), vz, 1e-4);
}

TEST(Strapdown, AConstantRateOverALongStepIsThatOfManyShortOnes) {
  const Vector3 w{0.8F, -1.1F, 2.0F}, f{1, -2, 9};
  ImuIncrement fine = ImuIncrement::constant(w, f, {500});
  for (int i = 1; i < 40; ++i) fine = fine.then(ImuIncrement::constant(w, f, {500}));
  const auto whole = ImuIncrement::constant(w, f, {20'000});
  EXPECT_LT((fine.dtheta_b_rad - whole.dtheta_b_rad).norm(), 1e-6F);
  EXPECT_LT((fine.dv_b_mps - whole.dv_b_mps).norm(), 1e-6F);
  EXPECT_EQ(fine.dt, whole.dt);
}

TEST(Strapdown, TheEarthTurnsUnderAGyrocompass) {
  const Earth earth = Earth::at(nav::LocalFrame(static_cast<std::int64_t>(48 * 5e8), 0, 0.0F), true);
  InsState x;
  x.q_nb = nav::from_euler({.yaw_rad = 0.4F});
  const InsState begin = x;
  for (int i = 0; i < 20'000; ++i) {  // at rest for 100 s: the gyroscope shows the Earth's rate
    const Vector3 w_b = x.q_nb.conjugate().rotate(earth.rate_n_radps);
    nav::strapdown(x, ImuIncrement::constant(w_b, {0, 0, earth.gravity_mps2}, k5ms), earth);
  }
  EXPECT_LT(x.minus(begin).segment<3>(6).norm(), 1e-4F) << "7.3 mrad if the rate were not taken off";
}

TEST(Strapdown, ACreepOfOneMillimetrePerSecondAddsUpFarFromTheOrigin) {
  for (const double origin_m : {0.0, 100.0, 127.9, 50'000.0, -50'000.3}) {
    InsState x;
    x.x = {.anchor_um = 0, .offset_m = static_cast<float>(origin_m)};  // as coarse as it may come
    const double begin_m = test::metres(x.x);
    x.v_n_mps = {0.001F, 0, 0};
    const Earth earth;
    for (int i = 0; i < 24'000; ++i)
      nav::strapdown(x, ImuIncrement::constant({0, 0, 0}, {0, 0, earth.gravity_mps2}, {2'500}), earth);
    EXPECT_NEAR(test::metres(x.x) - begin_m, 0.06, 6e-4) << origin_m;
  }
}

TEST(Move, KeepsEveryMicrometreOfLargeAndSmallSteps) {
  double truth = -3.25;
  base::Anchored x = test::anchored(truth);
  test::Normal normal(5);
  for (int i = 0; i < 20'000; ++i) {
    const float d = static_cast<float>(normal() * (i % 3 == 0 ? 1e-4 : i % 3 == 1 ? 0.7 : 5000.0));
    truth += static_cast<double>(d);
    nav::move(x, d);
    ASSERT_LE(std::abs(x.offset_m), 1.0F);
    ASSERT_NEAR(test::metres(x), truth, 1e-8 * (i + 100)) << i;
  }
}

}  // namespace
}  // namespace tetap
