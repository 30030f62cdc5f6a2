// SPDX-License-Identifier: Apache-2.0
// Clones of a scanner's pose beside the inertial filter, against one dense Kalman filter of all errors in double.
#include "tetap/estimators/all_round/scan_clones.hpp"

#include "tetap/model/gnss_velocity_3d.hpp"

#include <gtest/gtest.h>
#include <Eigen/Dense>
#include <cmath>
#include <random>

namespace tetap::estimators {
namespace {

using Dense = Eigen::MatrixXd;
constexpr int kState = 15, kKey = 15, kSeen = 18, kTurned = 21, kEverything = 22;
constexpr double kLater_s = 0.004;

/// Filter with clones, and beside it the covariance of all their errors, moved by the textbook's products.
struct CloneBench {
  std::mt19937 random{7};
  nav::Ins ins;
  ScanClones clones;
  Dense p = Dense::Zero(kEverything, kEverything);
  const slam::Displacement<float> mounting{0.4F, -0.2F, slam::Heading<float>::from_radians(0.7F)};

  double normal() { return std::normal_distribution<double>{}(random); }
  CloneBench() {
    Eigen::VectorXd size(kState);
    size << 0.3, 0.3, 0.5, 0.05, 0.05, 0.05, 0.003, 0.003, 0.02, 0.05, 0.05, 0.05, 1e-3, 1e-3, 1e-3;
    Dense a(kState, kState);
    for (double& one : a.reshaped()) one = normal();
    a = size.asDiagonal() * a;
    p.topLeftCorner(kState, kState) = a * a.transpose() / kState;
    p(kTurned, kTurned) = std::pow(static_cast<double>(ScanClones::kMount_rad), 2);
    nav::InsState x;
    x.v_n_mps << 0.8F, 1.1F, 0.0F;
    x.q_nb = nav::exp_quaternion({0.0F, 0.0F, 0.9F});
    EXPECT_TRUE(ins.start(x, nav::Ins::Covariance::upper_of(p.topLeftCorner<kState, kState>().cast<float>())));
  }
  void move(const Dense& f) { p = f * p * f.transpose(); }
  void take() {
    clones.take_scan(ins, static_cast<float>(kLater_s), 0.0F, mounting);
    const double lx = std::cos(0.9) * 0.4 + std::sin(0.9) * 0.2, ly = std::sin(0.9) * 0.4 - std::cos(0.9) * 0.2;
    Dense f = Dense::Identity(kEverything, kEverything);
    f.middleRows(kSeen, 3).setZero();
    f(kSeen, 0) = f(kSeen + 1, 1) = f(kSeen + 2, 8) = f(kSeen + 2, kTurned) = 1;
    f(kSeen, 3) = f(kSeen + 1, 4) = kLater_s;
    f(kSeen, 8) = -ly, f(kSeen + 1, 8) = lx;
    move(f);
  }
  void keep() {
    clones.keep_scan();
    Dense f = Dense::Identity(kEverything, kEverything);
    f.middleRows(kKey, 3) = f.middleRows(kSeen, 3).eval();
    move(f);
  }
  void drive(double dt_s) {
    nav::InsCovarianceStep<float> step{.dt_s = static_cast<float>(dt_s)};
    step.dv_n_mps << 0.1F, -0.2F, 0.05F;
    step.r_dt = ins.x.q_nb.matrix() * step.dt_s;
    step.var_v = 1e-4F, step.var_theta = 1e-6F;
    nav::predict_covariance(ins.p, step);
    clones.predict(step);
    const Eigen::Matrix3d r = step.r_dt.cast<double>();
    const Eigen::Vector3d dv = step.dv_n_mps.cast<double>();
    Eigen::Matrix3d cross;
    cross << 0, -dv(2), dv(1), dv(2), 0, -dv(0), -dv(1), dv(0), 0;
    // The three shears one after the other, as the filter has them.
    Dense position = Dense::Identity(kEverything, kEverything), speed = position, attitude = position;
    position.block<3, 3>(0, 3) = dt_s * Eigen::Matrix3d::Identity();
    speed.block<3, 3>(3, 6) = -cross, speed.block<3, 3>(3, 9) = -r;
    attitude.block<3, 3>(6, 12) = -r;
    move(attitude * speed * position);
    for (int i = 0; i < 3; ++i) p(3 + i, 3 + i) += 1e-4, p(6 + i, 6 + i) += 1e-6;
    for (base::Anchored* one : {&ins.x.x, &ins.x.y}) nav::move(*one, 0.5F);
  }
  /// A velocity with its noise.
  void measure() {
    const model::GnssVelocity3d z{.v_n_mps = ins.x.v_n_mps, .sigma_horizontal_mps = 0.03F, .sigma_vertical_mps = 0.03F};
    EXPECT_EQ(ins.update(z, base::kInfinity, clones).verdict, filter::Verdict::kAccepted);
    const auto noise = z.noise();
    Dense h = Dense::Zero(3, kEverything), r = Dense::Zero(3, 3);
    for (int i = 0; i < 3; ++i) h(i, 3 + i) = 1, r(i, i) = static_cast<double>(noise(i));
    p -= p * h.transpose() * (h * p * h.transpose() + r).inverse() * h * p;
  }
  /// The displacement by the errors of both poses.
  [[nodiscard]] Dense rows() const {
    const auto d = clones.displacement().mean;
    const double yaw = 0.9 + 0.7, c = std::cos(yaw), s = std::sin(yaw);
    Dense h = Dense::Zero(3, kEverything);
    h.block<2, 2>(0, kSeen) << c, s, -s, c;
    h.block<2, 2>(0, kKey) = -h.block<2, 2>(0, kSeen);
    h(0, kKey + 2) = static_cast<double>(d.y_m), h(1, kKey + 2) = -static_cast<double>(d.x_m);
    h(2, kSeen + 2) = 1, h(2, kKey + 2) = -1;
    return h;
  }
  void expect_same(const char* when) const {
    for (int c = 0; c < kState; ++c)
      for (int r = 0; r <= c; ++r)
        EXPECT_NEAR(static_cast<double>(ins.p(r, c)), p(r, c), 2e-3 * std::sqrt(p(r, r) * p(c, c))) << when << r << c;
    const Dense d = rows() * p * rows().transpose();
    const auto mine = clones.displacement().covariance;
    for (int c = 0; c < 3; ++c)
      for (int r = 0; r <= c; ++r)
        EXPECT_NEAR(static_cast<double>(mine(r, c)), d(r, c), 1e-2 * std::sqrt(d(r, r) * d(c, c))) << when << r << c;
  }
  void to_second_scan() {
    take();
    keep();
    for (int i = 0; i < 3; ++i) drive(0.5), measure();
    take();
  }
};

TEST(ScanClones, AreTheDenseFilterOfAllErrors) {
  CloneBench bench;
  bench.to_second_scan();
  bench.expect_same("before the match ");
  Dense a(3, 3);
  for (double& one : a.reshaped()) one = bench.normal();
  const Eigen::Vector3d size(100, 150, 1000);
  const Dense information = size.asDiagonal() * (a * a.transpose() + Dense::Identity(3, 3)) * size.asDiagonal();
  const Eigen::Vector3d off(0.004, -0.003, 5e-4), weighted = information * off;
  DisplacementLikelihood z{.about = bench.clones.displacement().mean, .information = {}};
  z.information = filter::Symmetric<float, 3>::upper_of(information.cast<float>());
  for (std::size_t i = 0; i < 3; ++i) z.weighted[i] = static_cast<float>(weighted(static_cast<int>(i)));
  const Dense h = bench.rows();
  const Dense gain = bench.p * h.transpose() * (h * bench.p * h.transpose() + information.inverse().eval()).inverse();
  const Eigen::VectorXd dx = gain * off;
  const nav::InsState before = bench.ins.x;
  EXPECT_EQ(bench.clones.fuse(bench.ins, z, 100).verdict, sensor::Verdict::kAccepted);
  bench.p -= gain * h * bench.p;
  bench.expect_same("after the match ");
  const auto moved = bench.ins.x.minus(before);
  for (int i = 0; i < kState; ++i)
    EXPECT_NEAR(static_cast<double>(moved(i)), dx(i), 1e-2 * std::abs(dx(i)) + 1e-3 * std::sqrt(bench.p(i, i))) << i;
  EXPECT_NEAR(static_cast<double>(bench.clones.mount_rad()), dx(kTurned), 2e-5);
}

/// Normal equations in double: the likelihood and the prior together are the posterior.
TEST(ScanClones, ALikelihoodLeadsFromThePriorToThePosterior) {
  CloneBench bench;
  const Eigen::Vector3d size(0.05, 0.02, 0.004), off(0.03, -0.02, 0.006);
  const auto drawn = [&] {
    Eigen::Matrix3d a;
    for (double& one : a.reshaped()) one = bench.normal();
    return Eigen::Matrix3d(size.asDiagonal() * (a * a.transpose() + Eigen::Matrix3d::Identity()) * size.asDiagonal());
  };
  const Eigen::Matrix3d more = drawn(), prior = drawn();
  const Eigen::Matrix3d posterior = (prior.inverse() + more.inverse()).inverse();
  const auto single = [](const Eigen::Matrix3d& p) { return filter::Symmetric<float, 3>::upper_of(p.cast<float>()); };
  const slam::Displacement<float> mean{1.0F, -0.5F, slam::Heading<float>::from_radians(0.2F)},
      found{1.03F, -0.52F, slam::Heading<float>::from_radians(0.206F)};
  const auto z = DisplacementLikelihood::between({.mean = mean, .covariance = single(prior)},
                                                 {.mean = found, .covariance = single(posterior)});
  const Eigen::Matrix3d information = more.inverse();
  const Eigen::Vector3d weighted = posterior.inverse() * off;
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(static_cast<double>(z.weighted[static_cast<std::size_t>(c)]), weighted(c), 1e-3 * weighted.norm()) << c;
    for (int r = 0; r <= c; ++r)
      EXPECT_NEAR(static_cast<double>(z.information(r, c)), information(r, c),
                  1e-3 * std::sqrt(information(r, r) * information(c, c)))
          << r << c;
  }
  const auto none = DisplacementLikelihood::between({.mean = mean, .covariance = {}},
                                                    {.mean = found, .covariance = single(posterior)});
  EXPECT_EQ(none.information(2, 2), 0.0F);
}

TEST(ScanClones, ACorridorLeavesItsDirectionToTheFilter) {
  CloneBench bench;
  bench.to_second_scan();
  const auto before = bench.clones.displacement().covariance;
  DisplacementLikelihood z{.about = bench.clones.displacement().mean, .information = {}};
  z.information(1, 1) = 1e6F, z.information(2, 2) = 1e8F;
  const Innovation fused = bench.clones.fuse(bench.ins, z, 1);
  const auto after = bench.clones.displacement().covariance;
  EXPECT_EQ(fused.dof, 2);
  EXPECT_GT(after(0, 0), 0.3F * before(0, 0));  // less by what it shares with the two others
  EXPECT_LT(after(1, 1), 1.1e-6F);
  EXPECT_LT(after(2, 2), 1.1e-8F);
}

TEST(ScanClones, ARefusedDisplacementChangesNothing) {
  CloneBench bench;
  bench.to_second_scan();
  DisplacementLikelihood z{.about = bench.clones.displacement().mean, .information = {}};
  z.information = filter::Symmetric<float, 3>::diagonal({1e6F, 1e6F, 1e8F});
  z.weighted = {3e6F, 0, 0};  // 3 m off
  const Innovation fused = bench.clones.fuse(bench.ins, z, 1);
  EXPECT_EQ(fused.verdict, sensor::Verdict::kRejected);
  EXPECT_GT(fused.nis, fused.gate);
  bench.expect_same("refused ");
}

}  // namespace
}  // namespace tetap::estimators
