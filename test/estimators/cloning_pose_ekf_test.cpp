// SPDX-License-Identifier: Apache-2.0
// Displacements between stamps in the planar filter, against least squares over all poses at once; their laws; wrong
// ones, and those that begin nowhere.
#include "tetap/estimators/planar/cloning_pose_ekf.hpp"
#include "config/parameters/mrclam.hpp"

#include <gtest/gtest.h>
#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

namespace tetap::estimators {
namespace {

struct Displaced {
  double x = 0, y = 0, yaw = 0;
};
/// A robot at the origin that is sure of its heading, with one landmark 50 m ahead.
struct Robot {
  explicit Robot(float sigma_m = 0.1F, float sigma_yaw_rad = 1e-3F, bool wheels = true) {
    n.wheels.noise = {.speed = 1e-3F, .yaw_rate = 1e-7F};
    n.wheels.hold = param::Hold::kBackward;
    n.landmark.sigma_range_only_m = 0.2F, n.landmark.sigma_range_per_m = 0;
    static_cast<void>(map.put({.x_mm = 50'000, .id = 7}));
    frame.map = &map;
    estimator.restart({kStart_us}, ctx());
    estimator.set_pose({kStart_us}, {.sigma_position_m = sigma_m, .sigma_yaw_rad = sigma_yaw_rad}, ctx());
    if (wheels) estimator.fuse(sensor::BodySpeed{}, {us}, ctx());
  }
  [[nodiscard]] Context ctx() const { return {.parameters = n, .map_frame = frame}; }
  /// 0.1 s by the wheels.
  void drive(double speed_mps, double rate_radps = 0) {
    us += 100'000;
    const sensor::BodySpeed speed{static_cast<float>(speed_mps), static_cast<float>(rate_radps)};
    EXPECT_EQ(estimator.fuse(speed, {us}, ctx()).verdict, sensor::Verdict::kAccepted);
  }
  Innovation moved(const Displaced& d, double sigma_m, double sigma_yaw_rad, std::int64_t since_us) {
    const auto steps = [](double v, float per_unit) {
      return static_cast<std::uint16_t>(std::lround(v * static_cast<double>(per_unit)));
    };
    const std::uint16_t m = steps(sigma_m, sensor::RelativePose::kStepsPerMetre);
    const std::uint16_t rad = steps(sigma_yaw_rad, sensor::RelativePose::kStepsPerRadian);
    return estimator.fuse(sensor::RelativePose{.x_m = static_cast<float>(d.x),
                                               .y_m = static_cast<float>(d.y),
                                               .yaw_rad = static_cast<float>(d.yaw),
                                               .interval_us = static_cast<std::uint32_t>(us - since_us),
                                               .sigma = {m, m, rad}},
                          {us}, ctx());
  }
  Innovation sees(double range_m) {
    return estimator.fuse(
        sensor::LandmarkSighting{.landmark = 7, .range_m = static_cast<float>(range_m), .bearing_rad = base::kNan},
        {us}, ctx());
  }
  [[nodiscard]] Estimate estimate() {
    estimator.advance({us}, ctx());
    return estimator.estimate(ctx());
  }
  param::Parameters n = robot::mrclam::parameters;
  LandmarkMap<kMapCapacity> map;
  MapFrame frame;
  CloningPoseEkf estimator;
  static constexpr std::int64_t kStart_us = 1'000'000;
  std::int64_t us = kStart_us;
};

/// Along x alone: rows of a linear problem in all positions, one for each 0.1 s.
struct Batch {
  Eigen::MatrixXd information;
  Eigen::VectorXd vector;
  explicit Batch(int poses) : information(Eigen::MatrixXd::Zero(poses, poses)), vector(Eigen::VectorXd::Zero(poses)) {}
  void add(int from, int to, double z, double variance) {  // from -1: the origin
    Eigen::VectorXd row = Eigen::VectorXd::Zero(vector.size());
    row(to) = 1;
    if (from >= 0) row(from) = -1;
    information += row * row.transpose() / variance;
    vector += row * z / variance;
  }
};

TEST(CloningPoseEkf, IsLeastSquaresOverAllPoses) {
  for (const bool keyframes : {false, true}) {  // each displacement from the one before, or five from one keyframe
    constexpr int kPoses = 61;
    Robot robot;
    Batch batch(kPoses);
    batch.add(-1, 0, 0, 0.01);
    std::mt19937 random{5};
    std::normal_distribution<double> normal;
    double truth = 0;
    std::array<double, kPoses> at{};
    int begin = -1;
    for (int k = 1; k < kPoses; ++k) {
      const double way = 0.1 + 0.01 * normal(random);
      truth += way, at[static_cast<std::size_t>(k)] = truth;
      robot.drive(1.0);
      batch.add(k - 1, k, 0.1, 1e-4);
      if (k % 7 == 3) {
        const double range = std::round((50 - truth + 0.2 * normal(random)) * 64) / 64;
        EXPECT_EQ(robot.sees(range).verdict, sensor::Verdict::kAccepted);
        batch.add(-1, k, 50 - range, 0.04);
      }
      const int from = keyframes ? k - 1 - (k - 1) % 5 : k - 1;
      const double moved = truth - at[static_cast<std::size_t>(from)] + 0.005 * normal(random);
      const Innovation fate = robot.moved({moved, 0, 0}, 0.005, 0.01, Robot::kStart_us + 100'000 * from);
      EXPECT_EQ(fate.verdict, begin < 0 || from == 0 ? sensor::Verdict::kNotUsed : sensor::Verdict::kAccepted) << k;
      if (fate.verdict == sensor::Verdict::kAccepted) batch.add(from, k, moved, 2.5e-5);
      begin = k;
      const Eigen::MatrixXd inverse = batch.information.topLeftCorner(k + 1, k + 1).inverse();
      const double x = (inverse * batch.vector.head(k + 1))(k), variance = inverse(k, k);
      const Estimate e = robot.estimate();
      EXPECT_NEAR(static_cast<double>(e.pose.x.minus({})), x, 2e-4 + 0.01 * std::sqrt(variance)) << k;
      EXPECT_NEAR(static_cast<double>(e.p(0, 0)) / variance, 1, 0.02) << k;
    }
  }
}

/// The way b after the way a, with the covariances that add up: a law of any displacement.
TEST(CloningPoseEkf, OneDisplacementSplitInTwoIsTheSame) {
  const auto drive = [](bool split) {
    Robot robot(0.1F, 0.02F, false);
    const auto nothing = robot.moved({}, 0.01, 0.002, robot.us - 100'000);
    EXPECT_EQ(nothing.failed, sensor::Check::kTime) << "the first one begins nowhere";
    for (int k = 0; k < 20; ++k) {  // without wheels: the displacements alone are the motion
      const std::int64_t begin = robot.us;
      robot.us += 50'000;
      if (split) {
        EXPECT_EQ(robot.moved({0.05, 0, 0.03}, 0.006, 0.002, begin).verdict, sensor::Verdict::kAccepted);
      }
      const std::int64_t middle = robot.us;
      robot.us += 50'000;
      const double c = std::cos(0.03), s = std::sin(0.03);
      // J of the second way by the first yaw makes the covariance of both; it is left out of this axis-aligned sigma.
      const auto fate = split ? robot.moved({0.05, 0, 0.03}, 0.006, 0.002, middle)
                              : robot.moved({0.05 + 0.05 * c, 0.05 * s, 0.06}, 0.006 * std::numbers::sqrt2,
                                            0.002 * std::numbers::sqrt2, begin);
      EXPECT_EQ(fate.verdict, sensor::Verdict::kAccepted) << k;
    }
    return robot.estimate();
  };
  const Estimate whole = drive(false), halves = drive(true);
  EXPECT_NEAR(whole.pose.x.minus({}), halves.pose.x.minus({}), 2e-3F);
  EXPECT_NEAR(whole.pose.y.minus({}), halves.pose.y.minus({}), 2e-3F);
  EXPECT_NEAR(whole.pose.yaw_rad, halves.pose.yaw_rad, 1e-3F);
  EXPECT_NEAR(whole.pose.yaw_rad, 1.2F, 2e-3F);
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(whole.p(i, i) / halves.p(i, i), 1.0F, 0.03F) << i;
}

TEST(CloningPoseEkf, AWrongDisplacementIsRefusedByTheGateAndTheNextIsUsed) {
  Robot robot, without;
  const auto step = [](Robot& r, double seen) {
    const std::int64_t begin = r.us;
    r.drive(1.0);
    return r.moved({seen, 0, 0}, 0.005, 0.01, begin);
  };
  for (int k = 0; k < 5; ++k) step(robot, 0.1), step(without, 0.1);
  without.drive(1.0);
  const Innovation wrong = step(robot, 0.6);
  EXPECT_EQ(wrong.verdict, sensor::Verdict::kRejected);
  EXPECT_EQ(wrong.failed, sensor::Check::kGate);
  EXPECT_EQ(wrong.dof, 3);
  EXPECT_GT(wrong.nis, wrong.gate);
  EXPECT_EQ(robot.estimate().pose.x.minus({}), without.estimate().pose.x.minus({}));
  EXPECT_EQ(robot.estimate().p.packed(), without.estimate().p.packed());
  EXPECT_EQ(step(robot, 0.1).verdict, sensor::Verdict::kAccepted) << "its end is where the next one begins";
  const Innovation nowhere = robot.moved({0.2, 0, 0}, 0.005, 0.01, robot.us - 250'000);
  EXPECT_EQ(nowhere.verdict, sensor::Verdict::kNotUsed);
  EXPECT_EQ(nowhere.failed, sensor::Check::kTime);
  robot.estimator.set_pose({robot.us}, {.sigma_position_m = 0.1F, .sigma_yaw_rad = 0.01F}, robot.ctx());
  EXPECT_EQ(step(robot, 0.1).failed, sensor::Check::kTime) << "a given pose has no past";
}

TEST(CloningPoseEkf, AnAxisWithoutASigmaChangesNothingThere) {
  Robot robot;
  robot.drive(1.0), robot.moved({0.1, 0, 0}, 0.005, 0.001, Robot::kStart_us);
  const auto before = robot.estimate().p;
  const std::int64_t begin = robot.us;
  robot.drive(1.0);
  const auto moved = robot.estimate();
  const Innovation fate =
      robot.estimator.fuse(sensor::RelativePose{.x_m = 9,
                                                .interval_us = static_cast<std::uint32_t>(robot.us - begin),
                                                .sigma = {sensor::RelativePose::kFree, 10, 5}},
                           {robot.us}, robot.ctx());
  EXPECT_EQ(fate.verdict, sensor::Verdict::kAccepted);
  EXPECT_EQ(fate.dof, 2);
  EXPECT_NEAR(robot.estimate().pose.x.minus({}), moved.pose.x.minus({}), 1e-5F);
  EXPECT_NEAR(robot.estimate().p(0, 0), moved.p(0, 0), 1e-6F);
  EXPECT_GT(moved.p(0, 0), before(0, 0));
}

}  // namespace
}  // namespace tetap::estimators
