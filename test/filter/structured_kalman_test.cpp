// SPDX-License-Identifier: Apache-2.0
// The filter that skips declared zeros and ones, beside Joseph's form in double with dense models (held to SciPy by
// reference_test.py). Each structure stands beside its dense matrix, with every option.
#include "tetap/filter/structured_kalman.hpp"

#include "support/structured_models.hpp"
#include "tetap/filter/joseph.hpp"
#include "tetap/filter/kalman.hpp"
#include "tetap/model/constant_velocity.hpp"

#include <gtest/gtest.h>
#include <cmath>
#include <random>

namespace tetap {
namespace {

using filter::Guard;
using filter::Symmetric;
using filter::VectorState;

constexpr int kSteps = 256;

/// Largest difference so far: states in standard deviations, P in sigma_i sigma_j.
struct Worst {
  double state = 0, covariance = 0;
  template <int N>
  void compare(const VectorState<float, N>& x, const Symmetric<float, N>& p, const VectorState<double, N>& x_ref,
               const Symmetric<double, N>& p_ref) {
    for (int c = 0; c < N; ++c) {
      state = std::max(state, std::abs(static_cast<double>(x.value(c)) - x_ref.value(c)) / std::sqrt(p_ref(c, c)));
      for (int r = 0; r <= c; ++r)
        covariance = std::max(
            covariance, std::abs(static_cast<double>(p(r, c)) - p_ref(r, c)) / std::sqrt(p_ref(r, r) * p_ref(c, c)));
    }
  }
};

template <Guard kGuard, class Gate>
Worst constant_velocity(const Gate& gate) {
  Worst worst;
  for (unsigned seed = 0; seed < 50; ++seed) {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    filter::StructuredKalman<VectorState<float, 4>, kGuard> kf;
    filter::JosephKalman<VectorState<double, 4>> reference;
    kf.p = Symmetric<float, 4>::diagonal({10, 10, 10, 10});
    reference.set_covariance(Symmetric<double, 4>::diagonal({10, 10, 10, 10}));
    for (int k = 0; k < kSteps; ++k) {
      const auto x = static_cast<float>(0.1 * k + 0.5 * normal(random));
      const auto y = static_cast<float>(0.05 * k + 0.5 * normal(random));
      EXPECT_TRUE(kf.predict(test::StructuredVelocity{.dt_s = 0.1F, .acceleration_variance = 0.1F}));
      EXPECT_TRUE(reference.predict(model::ConstantVelocity<double>{
          .dt_s = static_cast<double>(0.1F), .acceleration_variance = static_cast<double>(0.1F)}));
      EXPECT_EQ(
          kf.update(filter::DirectMeasurement<float, 4, 0, 2>{.z = {x, y}, .variance = {0.25F, 0.25F}}, gate).verdict,
          filter::Verdict::kAccepted);
      static_cast<void>(reference.update(
          filter::DirectMeasurement<double, 4, 0, 2>{.z = {static_cast<double>(x), static_cast<double>(y)},
                                                     .variance = {0.25, 0.25}},
          1e9));
      worst.compare<4>(kf.x, kf.p, reference.x, reference.covariance());
    }
  }
  return worst;
}

template <Guard kGuard, class Gate>
Worst unicycle(const Gate& gate) {
  Worst worst;
  for (unsigned seed = 0; seed < 50; ++seed) {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    filter::StructuredKalman<VectorState<float, 3>, kGuard> kf;
    filter::JosephKalman<VectorState<double, 3>> reference;
    kf.p = Symmetric<float, 3>::diagonal({0.1F, 0.1F, 0.05F});
    reference.set_covariance(Symmetric<double, 3>::diagonal(
        {static_cast<double>(0.1F), static_cast<double>(0.1F), static_cast<double>(0.05F)}));
    double x = 0, y = 0, yaw = 0;
    for (int k = 0; k < kSteps; ++k) {
      const test::EulerUnicycle<float> motion{
          .ds_m = 0.1F, .dyaw_rad = static_cast<float>(0.03 * std::cos(0.05 * k)), .variance = {1e-3F, 1e-3F, 1e-4F}};
      x += 0.1 * std::cos(yaw), y += 0.1 * std::sin(yaw), yaw += static_cast<double>(motion.dyaw_rad);
      const test::EulerSight<float> sight{
          .range_m = static_cast<float>(std::hypot(60 - x, 20 - y) + 0.1 * normal(random)),
          .bearing_rad = static_cast<float>(std::atan2(20 - y, 60 - x) - yaw + 0.02 * normal(random)),
          .variance = {0.01F, 4e-4F}};
      EXPECT_TRUE(kf.predict(test::StructuredUnicycle{motion}));
      EXPECT_EQ(kf.update(test::StructuredSight{sight}, gate).verdict, filter::Verdict::kAccepted);
      EXPECT_TRUE(reference.predict(test::EulerUnicycle<double>{
          .ds_m = static_cast<double>(motion.ds_m),
          .dyaw_rad = static_cast<double>(motion.dyaw_rad),
          .variance = {static_cast<double>(1e-3F), static_cast<double>(1e-3F), static_cast<double>(1e-4F)}}));
      static_cast<void>(reference.update(
          test::EulerSight<double>{.range_m = static_cast<double>(sight.range_m),
                                   .bearing_rad = static_cast<double>(sight.bearing_rad),
                                   .variance = {static_cast<double>(0.01F), static_cast<double>(4e-4F)}},
          1e9));
      worst.compare<3>(kf.x, kf.p, reference.x, reference.covariance());
    }
  }
  return worst;
}

void expect_below(const Worst& worst, double state, double covariance) {
  EXPECT_LT(worst.state, state);
  EXPECT_LT(worst.covariance, covariance);
  EXPECT_GT(worst.state, 0) << "nothing was compared";
}

TEST(StructuredKalman, EqualsJosephInDoubleWhateverIsAsked) {
  expect_below(constant_velocity<Guard::kNone>(filter::NoGate{}), 1e-4, 5e-6);
  expect_below(constant_velocity<Guard::kNone>(1e9F), 1e-4, 5e-6);
  expect_below(constant_velocity<Guard::kVariances>(1e9F), 1e-4, 5e-6);
  expect_below(unicycle<Guard::kNone>(filter::NoGate{}), 2e-4, 6e-5);
  expect_below(unicycle<Guard::kVariances>(1e9F), 2e-4, 6e-5);
  expect_below(unicycle<Guard::kConditioned>(1e9F), 2e-4, 6e-5);
}

TEST(StructuredKalman, StructuresAreTheMatricesTheyStandFor) {
  using filter::Entry;
  std::mt19937 random(51);
  std::normal_distribution<float> normal;
  for (int i = 0; i < 100; ++i) {
    filter::Matrix<float, 4, 4> root;
    for (int k = 0; k < 16; ++k) root(k / 4, k % 4) = normal(random);
    const auto p = Symmetric<float, 4>::upper_of(root.lazyProduct(root.transpose()));
    // Two entries in one row, one on the diagonal, one below it.
    const filter::UnitPlus<float, 4, Entry{0, 1}, Entry{0, 3}, Entry{2, 2}, Entry{3, 1}> f{
        {normal(random), normal(random), normal(random), normal(random)}};
    const filter::SparseSymmetric<float, 4, Entry{1, 1}, Entry{0, 2}> q{{normal(random), normal(random)}};
    auto got = filter::turned(p, f);
    filter::add_noise(got, q);
    const Eigen::Matrix4d expected =
        f.dense().cast<double>() * p.dense().cast<double>() * f.dense().cast<double>().transpose() +
        q.dense().dense().cast<double>();
    EXPECT_LT((got.dense().cast<double>() - expected).norm(), 1e-6 * expected.norm());
  }
}

TEST(StructuredKalman, TheGateRejectsAndTheGuardsRefuseWithoutAChange) {
  using Position = filter::DirectMeasurement<float, 4, 0, 2>;
  filter::StructuredKalman<VectorState<float, 4>> kf;
  kf.p = Symmetric<float, 4>::diagonal({1, 1, 1, 1});
  const auto well = kf;
  const auto same = [&] { return kf.x.value == well.x.value && kf.p.packed() == well.p.packed(); };
  const auto far = kf.update(Position{.z = {9, 0}, .variance = {1, 1}}, 9.21F);
  EXPECT_EQ(far.verdict, filter::Verdict::kRejected);
  EXPECT_FLOAT_EQ(far.nis, 40.5F);
  EXPECT_TRUE(same());
  EXPECT_EQ(kf.update(Position{.z = {base::kNan, 0}, .variance = {1, 1}}, 9.21F).verdict, filter::Verdict::kNotFinite);
  EXPECT_EQ(kf.update(Position{.z = {0, 0}, .variance = {-3, 1}}, 9.21F).verdict, filter::Verdict::kSingular);
  EXPECT_FALSE(kf.predict(test::StructuredVelocity{.dt_s = base::kNan, .acceleration_variance = 1}));
  EXPECT_FALSE(kf.predict(test::StructuredVelocity{.dt_s = 1e16F, .acceleration_variance = 1}));
  EXPECT_FALSE(kf.predict(test::StructuredVelocity{.dt_s = 0.1F, .acceleration_variance = -1e6F}));
  EXPECT_TRUE(same());
  // Guard::kNone has the gate and nothing else.
  filter::StructuredKalman<VectorState<float, 4>, Guard::kNone> bare;
  bare.p = well.p;
  EXPECT_EQ(bare.update(Position{.z = {9, 0}, .variance = {1, 1}}, 9.21F).verdict, filter::Verdict::kRejected);
  EXPECT_EQ(bare.p.packed(), well.p.packed());
}

/// The cheap test never accepts what the factor refuses, and accepts nearly all that is no borderline case.
TEST(StructuredKalman, TheCheapTestOfConditionIsSufficient) {
  std::mt19937 random(7);
  std::normal_distribution<float> normal;
  int accepted = 0, well = 0;
  constexpr int kTrials = 200'000;
  for (int trial = 0; trial < kTrials; ++trial) {
    // P = L L^T with a last column that is anything from independent to a copy of the others.
    const float own = std::pow(10.0F, -5.0F * static_cast<float>(trial % 100) / 99.0F);
    float l[3][3] = {{normal(random), 0, 0},
                     {normal(random), normal(random), 0},
                     {normal(random), normal(random), own * normal(random)}};
    const float scale[3] = {1e3F, 1.0F, 1e-4F};
    Symmetric<float, 3> p;
    for (int r = 0; r < 3; ++r)
      for (int c = r; c < 3; ++c) {
        float sum = 0;
        for (int k = 0; k < 3; ++k) sum += l[r][k] * l[c][k];
        p(r, c) = sum * scale[r] * scale[c] * (trial % 7 == 0 && r != c ? 1.0F + 1e-3F * normal(random) : 1.0F);
      }
    const bool fine = filter::well_conditioned(p), surely = filter::surely_well_conditioned(p);
    EXPECT_TRUE(fine || !surely) << trial;
    accepted += surely ? 1 : 0;
    well += fine ? 1 : 0;
  }
  EXPECT_GT(accepted, well / 2);
  EXPECT_LT(accepted, well) << "trials without borderline cases prove little";
  Symmetric<float, 3> nan = Symmetric<float, 3>::diagonal({1, 1, 1});
  nan(0, 1) = base::kNan;
  EXPECT_FALSE(filter::surely_well_conditioned(nan));
}

}  // namespace
}  // namespace tetap
