// SPDX-License-Identifier: Apache-2.0
#include "tetap/filter/kalman.hpp"

#include "support/least_eigenvalue.hpp"
#include "tetap/filter/joseph.hpp"
#include "tetap/model/constant_velocity.hpp"

#include <gtest/gtest.h>
#include <cmath>

namespace tetap {
namespace {

using filter::Vector;
using test::least_eigenvalue;

// The worked example every textbook has: position and velocity, 0.1 s, one position measured.
TEST(Kalman, WorkedExampleStepByStep) {
  filter::Kalman<float, 2> kf;
  kf.p = filter::Symmetric<float, 2>::diagonal({10.0F, 10.0F});
  filter::LinearMotion<float, 2> motion;
  motion.f(0, 1) = 0.1F;
  motion.q = filter::Symmetric<float, 2>::diagonal({0.001F, 0.001F});
  kf.predict(motion);
  EXPECT_NEAR(kf.p(0, 0), 10.101F, 1e-5F);
  EXPECT_NEAR(kf.p(0, 1), 1.0F, 1e-6F);
  EXPECT_NEAR(kf.p(1, 1), 10.001F, 1e-5F);

  const filter::DirectMeasurement<float, 2, 0> position{.z = Vector<float, 1>(0.5F),
                                                        .variance = Vector<float, 1>(0.5F)};
  const auto innovation = kf.update(position, 9.0F);
  EXPECT_EQ(innovation.verdict, filter::Verdict::kAccepted);
  EXPECT_NEAR(innovation.nu(0), 0.5F, 1e-7F);
  EXPECT_NEAR(innovation.s(0, 0), 10.601F, 1e-5F);
  EXPECT_NEAR(innovation.nis, 0.25F / 10.601F, 1e-6F);
  EXPECT_NEAR(kf.x.value(0), 0.47642F, 1e-5F);
  EXPECT_NEAR(kf.x.value(1), 0.04717F, 1e-5F);
  EXPECT_NEAR(kf.x.value(0) / 0.5F, 0.95283F, 2e-5F) << "gain of position";
  EXPECT_NEAR(kf.x.value(1) / 0.5F, 0.09433F, 2e-5F) << "gain of velocity";
}

TEST(Kalman, ConvergesToTheRiccatiSolutionOfTheAlphaBetaFilter) {
  // Steady state of the piecewise-constant acceleration model (Kalata 1984). Tracking index L = sigma_w T^2 / sigma_v
  // and r = (4 + L - sqrt(8 L + L^2)) / 4 give alpha = 1 - r^2 and beta = 2 (2 - alpha) - 4 sqrt(1 - alpha).
  constexpr float kDt = 0.1F, kAcceleration = 4.0F, kVariance = 0.25F;
  filter::Ekf<model::ConstantVelocity<float>::State> kf;
  kf.p = filter::Symmetric<float, 4>::diagonal({10, 10, 10, 10});
  const model::ConstantVelocity<float> motion{.dt_s = kDt, .acceleration_variance = kAcceleration};
  float gain = 0;
  for (int k = 0; k < 500; ++k) {
    kf.predict(motion);
    kf.x.value.setZero();
    const filter::DirectMeasurement<float, 4, 0, 2> z{.z = {1.0F, -1.0F}, .variance = {kVariance, kVariance}};
    ASSERT_EQ(kf.update(z, 100.0F).verdict, filter::Verdict::kAccepted);
    gain = kf.x.value(0);
  }
  const double index = std::sqrt(static_cast<double>(kAcceleration)) * 0.01 / std::sqrt(static_cast<double>(kVariance));
  const double r = (4.0 + index - std::sqrt(8.0 * index + index * index)) / 4.0;
  EXPECT_NEAR(static_cast<double>(gain), 1.0 - r * r, 1e-4);
  EXPECT_NEAR(static_cast<double>(kf.x.value(1)), (2.0 * (1.0 + r * r) - 4.0 * r) / static_cast<double>(kDt), 1e-3);
  EXPECT_EQ(kf.x.value(0), -kf.x.value(2)) << "the axes are independent";
}

TEST(Kalman, AMeasurementBeyondTheGateChangesNothing) {
  filter::Kalman<float, 2> kf;
  kf.p = filter::Symmetric<float, 2>::diagonal({1, 1});
  const auto before = kf;
  const filter::DirectMeasurement<float, 2, 0> far{.z = Vector<float, 1>(10.0F), .variance = Vector<float, 1>(1.0F)};
  const auto innovation = kf.update(far, 6.63F);
  EXPECT_EQ(innovation.verdict, filter::Verdict::kRejected);
  EXPECT_FLOAT_EQ(innovation.nis, 50.0F);
  EXPECT_EQ(kf.x.value, before.x.value);
  EXPECT_EQ(kf.p.packed(), before.p.packed());
}

/// Sharp measurements of position beside an uncertain state, step by step, against Joseph's form in double.
struct Sharp {
  filter::Kalman<float, 4> kf;
  filter::JosephKalman<filter::VectorState<double, 4>> reference;

  explicit Sharp(float variance) {
    kf.p = filter::Symmetric<float, 4>::diagonal({variance, variance, variance, variance});
    const auto p = static_cast<double>(variance);
    reference.set_covariance(filter::Symmetric<double, 4>::diagonal({p, p, p, p}));
  }
  void predict() {
    ASSERT_TRUE(kf.predict(model::ConstantVelocity<float>{.dt_s = 0.125F, .acceleration_variance = 0.25F}));
    ASSERT_TRUE(reference.predict(model::ConstantVelocity<double>{.dt_s = 0.125, .acceleration_variance = 0.25}));
  }
  template <int... kStates>
  filter::Verdict update(float r) {
    constexpr int kM = sizeof...(kStates);
    static_cast<void>(reference.update(
        filter::DirectMeasurement<double, 4, kStates...>{
            .z = Vector<double, kM>::Zero(), .variance = Vector<double, kM>::Constant(static_cast<double>(r))},
        1e9));
    return kf
        .update(filter::DirectMeasurement<float, 4, kStates...>{.z = Vector<float, kM>::Zero(),
                                                                .variance = Vector<float, kM>::Constant(r)},
                1e9F)
        .verdict;
  }
  /// Positive definite, and no sigma is below half of double's.
  void judge() const {
    ASSERT_GT(least_eigenvalue(kf.p), 0);
    for (int i = 0; i < 4; ++i)
      ASSERT_GE(std::sqrt(static_cast<double>(kf.p(i, i))), 0.5 * std::sqrt(reference.covariance()(i, i))) << i;
  }
};

TEST(Kalman, StaysPositiveAndNeverTooSureUpToATrillionTimesSharper) {
  for (int decades = 0; decades <= 12; ++decades) {
    SCOPED_TRACE(decades);
    Sharp at(1e6F);
    const auto r = static_cast<float>(std::pow(10.0, 6 - decades));
    ASSERT_EQ((at.update<0, 2>(r)), filter::Verdict::kAccepted) << "from rest";
    ASSERT_NO_FATAL_FAILURE(at.judge());
    for (int k = 0; k < 2000; ++k) {
      ASSERT_NO_FATAL_FAILURE(at.predict());
      ASSERT_EQ((at.update<0, 2>(r)), filter::Verdict::kAccepted) << k;
      ASSERT_NO_FATAL_FAILURE(at.judge()) << k;
    }
  }
}

TEST(Kalman, TakesAMeasurementWithoutNoise) {
  Sharp at(100.0F);
  for (int k = 0; k < 2000; ++k) {
    ASSERT_EQ((at.update<0, 2>(0.0F)), filter::Verdict::kAccepted) << k;
    ASSERT_NO_FATAL_FAILURE(at.judge()) << k;
    ASSERT_NO_FATAL_FAILURE(at.predict());
  }
}

TEST(Kalman, TakesTwoEqualSharpSensorsAtOnce) {
  for (const float r : {1.0F, 1e-3F, 1e-6F, 1e-9F, 1e-12F}) {
    SCOPED_TRACE(r);
    Sharp at(1.0F);
    for (int k = 0; k < 2000; ++k) {
      ASSERT_EQ((at.update<0, 0>(r)), filter::Verdict::kAccepted) << k;
      ASSERT_NO_FATAL_FAILURE(at.judge()) << k;
      ASSERT_LT(std::sqrt(at.kf.p(0, 0)), 1.1F * std::sqrt(r) + 1e-3F) << k;
      ASSERT_NO_FATAL_FAILURE(at.predict());
    }
  }
}

}  // namespace
}  // namespace tetap
