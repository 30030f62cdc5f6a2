// SPDX-License-Identifier: Apache-2.0
// The covariance prediction by structure against the dense product in double, F against numeric differences of the
// strapdown equations, and what keeps P positive definite.
#include "tetap/nav/ins_covariance.hpp"
#include "tetap/nav/ins_covariance_entry.hpp"

#include "support/least_eigenvalue.hpp"
#include "tetap/nav/strapdown.hpp"
#include "true_body.hpp"

#include <gtest/gtest.h>

namespace tetap {
namespace {

using nav::InsState;
using Matrix15 = Eigen::Matrix<double, 15, 15>;
constexpr int kP = 0, kV = 3, kT = 6, kA = 9, kG = 12;

Eigen::Matrix3d skew(const Eigen::Vector3d& a) {
  Eigen::Matrix3d m;
  m << 0, -a(2), a(1), a(2), 0, -a(0), -a(1), a(0), 0;
  return m;
}

/// F in full, written out block by block.
Matrix15 transition(double dt, const Eigen::Vector3d& dv_n, const Eigen::Matrix3d& r_dt) {
  Matrix15 f = Matrix15::Identity();
  f.block<3, 3>(kP, kV) = dt * Eigen::Matrix3d::Identity();
  f.block<3, 3>(kV, kT) = -skew(dv_n);
  f.block<3, 3>(kV, kA) = -r_dt;
  f.block<3, 3>(kT, kG) = -r_dt;
  return f;
}

template <class Scalar>
filter::Symmetric<Scalar, 15> symmetric(const Matrix15& full) {
  return filter::Symmetric<Scalar, 15>::upper_of(full.cast<Scalar>());
}

Matrix15 random_covariance(test::Normal& normal) {
  Matrix15 a;
  for (int r = 0; r < 15; ++r)
    for (int c = 0; c < 15; ++c) a(r, c) = normal();
  Eigen::Matrix<double, 15, 1> size;
  size << 2, 2, 3, 0.3, 0.3, 0.2, 0.01, 0.01, 0.1, 0.05, 0.05, 0.05, 1e-3, 1e-3, 1e-3;
  const Matrix15 scaled = size.asDiagonal() * a;
  return scaled * scaled.transpose() / 15;
}

template <class Scalar>
void expect_dense(double tolerance) {
  test::Normal normal(6);
  for (int run = 0; run < 50; ++run) {
    const Matrix15 p0 = random_covariance(normal);
    const double dt = 0.002 + 0.001 * run;
    const Eigen::Vector3d dv = normal.vector() * 5 * dt;
    const Eigen::Matrix3d r_dt = test::exp_double(normal.vector()).toRotationMatrix() * dt;
    nav::InsCovarianceStep<Scalar> step{.dt_s = static_cast<Scalar>(dt), .dv_n_mps = dv.cast<Scalar>()};
    step.r_dt = r_dt.cast<Scalar>();
    step.var_v = static_cast<Scalar>(1e-6), step.var_theta = static_cast<Scalar>(2e-9);
    step.var_b_a = static_cast<Scalar>(3e-9), step.var_b_g = static_cast<Scalar>(4e-12);
    Matrix15 keep = Matrix15::Identity();
    if (run % 2 == 1) {
      step.keep_b_a = static_cast<Scalar>(0.999), step.keep_b_g = static_cast<Scalar>(0.9995);
      keep.diagonal().segment<3>(kA).setConstant(0.999);
      keep.diagonal().segment<3>(kG).setConstant(0.9995);
    }
    auto p = symmetric<Scalar>(p0);
    Matrix15 entries = Matrix15::Zero();
    if constexpr (std::is_same_v<Scalar, float>) {
      filter::unroll<0, 15>([&](auto r) {
        filter::unroll<0, 15>(
            [&](auto c) { entries(int{r}, int{c}) = static_cast<double>(nav::predicted_covariance<r, c>(p, step)); });
      });
      for (int first = 0; first < 15; first += 3) {
        const filter::Symmetric<float, 3> block = nav::predicted_block(p, step, first);
        for (int r = 0; r < 3; ++r)
          for (int c = 0; c < 3; ++c) {
            const double size = std::sqrt(entries(first + r, first + r) * entries(first + c, first + c));
            EXPECT_NEAR(static_cast<double>(block(r, c)), entries(first + r, first + c), 1e-5 * size) << first;
          }
      }
    }
    nav::predict_covariance(p, step);
    const Matrix15 f = keep * transition(dt, dv, r_dt);
    Matrix15 expected = f * p0 * f.transpose();
    expected.diagonal().segment<3>(kV).array() += 1e-6;
    expected.diagonal().segment<3>(kT).array() += 2e-9;
    expected.diagonal().segment<3>(kA).array() += 3e-9;
    expected.diagonal().segment<3>(kG).array() += 4e-12;
    for (int c = 0; c < 15; ++c)
      for (int r = 0; r < 15; ++r) {
        const double near = tolerance * std::sqrt(expected(r, r) * expected(c, c));
        EXPECT_NEAR(static_cast<double>(p(r, c)), expected(r, c), near) << r << ' ' << c;
        if constexpr (std::is_same_v<Scalar, float>) {
          EXPECT_NEAR(entries(r, c), expected(r, c), near) << r << ' ' << c;
        }
      }
  }
}

TEST(InsCovariance, PredictionByStructureIsTheDenseProduct) { expect_dense<double>(1e-14); }
TEST(InsCovariance, PredictionInFloatIsTheDenseProductToRounding) { expect_dense<float>(1e-6); }

/// Central differences in double: the judge's own strapdown equations, moved by every error in turn.
TEST(InsCovariance, TransitionIsTheDerivativeOfStrapdown) {
  test::Normal normal(7);
  for (int run = 0; run < 10; ++run) {
    const double dt = 0.005, gravity = 9.8, h = 1e-5;
    const Eigen::Vector3d gyro = normal.vector(), accel = Eigen::Vector3d(0, 0, 9.8) + 2 * normal.vector();
    test::TrueBody at;
    at.v_n = 3 * normal.vector();
    at.q_nb = test::exp_double(normal.vector());
    at.b_a = 0.1 * normal.vector();
    at.b_g = 0.01 * normal.vector();
    const auto after = [&](int c, double by) {
      test::TrueBody body = at;
      Eigen::Matrix<double, 15, 1> d = Eigen::Matrix<double, 15, 1>::Zero();
      d(c) = by;
      body.p_n += d.segment<3>(kP), body.v_n += d.segment<3>(kV), body.b_a += d.segment<3>(kA),
          body.b_g += d.segment<3>(kG);
      body.q_nb = test::exp_double(d.segment<3>(kT)) * body.q_nb;
      body.move((gyro - body.b_g) * dt, (accel - body.b_a) * dt, dt, gravity);
      return body;
    };
    Matrix15 numeric;
    for (int c = 0; c < 15; ++c) {
      const auto plus = after(c, h), minus = after(c, -h);
      Eigen::Matrix<double, 15, 1> d;
      d << plus.p_n - minus.p_n, plus.v_n - minus.v_n, test::log_double(plus.q_nb * minus.q_nb.conjugate()),
          plus.b_a - minus.b_a, plus.b_g - minus.b_g;
      numeric.col(c) = d / (2 * h);
    }
    InsState x = at.state();
    const auto step = nav::strapdown(x, test::increment(gyro * dt, accel * dt, 5'000), {.gravity_mps2 = 9.8F});
    const Matrix15 f = transition(dt, step.dv_n_mps.cast<double>(), step.r_nb.cast<double>() * dt);
    // theta <- b_g: the axes turn within the step, half of |w| dt^2 = 1e-4 at most.
    EXPECT_LT((numeric - f).bottomRows<12>().cwiseAbs().maxCoeff(), 1e-4);
    // p <- theta, b_a: what they do within the step, |f| dt^2 / 2.
    Matrix15 rest = numeric - f;
    EXPECT_LT(rest.topRows<3>().cwiseAbs().maxCoeff(), 2.5e-4);
    rest.topRows<3>().setZero();
    rest.block<3, 3>(kT, kG).setZero();
    EXPECT_LT(rest.cwiseAbs().maxCoeff(), 1e-5);
  }
}

TEST(InsCovariance, SeveralStepsAtOnceAreNearlyTheSameAsEachInTurn) {
  test::Normal normal(8);
  auto each = symmetric<double>(random_covariance(normal));
  auto once = each;
  nav::InsCovarianceStep<double> sum;
  for (int i = 0; i < 8; ++i) {
    nav::InsCovarianceStep<double> step{.dt_s = 0.005, .dv_n_mps = {0.01, 0.002 * i, 0.049}};
    step.r_dt = test::exp_double({0.01 * i, 0, 0.02 * i}).toRotationMatrix() * 0.005;
    step.var_v = 1e-8, step.var_theta = 1e-10;
    nav::predict_covariance(each, step);
    sum.dt_s += step.dt_s, sum.dv_n_mps += step.dv_n_mps, sum.r_dt += step.r_dt;
    sum.var_v += step.var_v, sum.var_theta += step.var_theta;
  }
  nav::predict_covariance(once, sum);
  for (int i = 0; i < 15; ++i) EXPECT_NEAR(once(i, i) / each(i, i), 1.0, 0.01) << i;
}

nav::InsFactor room;

TEST(Condition, LeavesAGoodCovarianceAlone) {
  test::Normal normal(9);
  for (int run = 0; run < 20; ++run) {
    Matrix15 good = random_covariance(normal);
    good.diagonal() *= 1.01;
    auto p = symmetric<float>(good);
    const auto before = p.packed();
    EXPECT_TRUE(nav::condition(p, room));
    EXPECT_EQ(p.packed(), before);
  }
}

TEST(Condition, MakesAnySymmetricMatrixPositiveDefinite) {
  test::Normal normal(10);
  for (int run = 0; run < 500; ++run) {
    // Low rank and rounding, correlations above one, negative and zero variances, huge ones.
    Matrix15 a = Matrix15::Zero();
    const int rank = run % 15;
    for (int r = 0; r < 15; ++r)
      for (int c = 0; c < rank; ++c) a(r, c) = normal() * std::pow(10.0, (r * 7 + run) % 9 - 5);
    Matrix15 full = a * a.transpose();
    if (run % 4 == 1) full(2, 7) = full(7, 2) = 3 * std::sqrt(full(2, 2) * full(7, 7)) + 1e-3;
    if (run % 4 == 2) full(run % 15, run % 15) = -full(run % 15, run % 15);
    if (run % 4 == 3) full *= 1e9;
    auto p = symmetric<float>(full);
    EXPECT_FALSE(nav::condition(p, room));
    EXPECT_TRUE(p.positive_definite()) << run;
    EXPECT_GT(test::least_eigenvalue(p), 0.0) << run;
    for (int i = 0; i < 15; ++i) {
      const float most = nav::kInsMostSigma[static_cast<std::size_t>(i / 3)];
      EXPECT_LE(p(i, i), most * most * 1.001F + 1e-19F);
    }
  }
}

TEST(Condition, CapsAVarianceAndKeepsItsCorrelations) {
  auto p = filter::Symmetric<float, 15>::diagonal({1, 1, 1, 1, 1, 1, 1, 1, 400, 1, 1, 1, 1, 1, 25});
  p(8, 14) = 0.9F * 20 * 5;
  nav::condition(p, room);
  EXPECT_NEAR(p(8, 8), 16.0F, 1e-5F);
  EXPECT_NEAR(p(8, 14) / std::sqrt(p(8, 8) * p(14, 14)), 0.9F, 1e-5F);
}

}  // namespace
}  // namespace tetap
