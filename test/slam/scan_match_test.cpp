// SPDX-License-Identifier: Apache-2.0
// Laws of the scan matcher in rooms whose walls are cast by determinants in double.
#include "tetap/slam/scan_match.hpp"
#include "slam/scan_world.hpp"

#include <gtest/gtest.h>
#include <Eigen/Cholesky>
#include <cstdio>
#include <random>

namespace tetap {
namespace {

using namespace test;

constexpr int kBeams = 361;
using Match = slam::ScanMatch<kBeams, 4>;
using Keyframes = slam::ScanKeyframes<kBeams, 4>;

/// x, y (m), yaw (rad).
Eigen::Vector3d mean(const slam::ScanMatchResult& result) {
  const auto& d = result.pose.mean;
  return Eigen::Vector3f(d.x_m, d.y_m, d.yaw.radians()).cast<double>();
}
Eigen::Matrix3d covariance(const slam::ScanMatchResult& result) {
  return result.pose.covariance.dense().cast<double>();
}
const slam::ScanMatchResult& run(Match& match, const Keyframes& keyframes, const slam::ScanGeometry& g,
                                 const Ranges& ranges, const Motion& prior, int units = 1'000'000) {
  EXPECT_TRUE(match.begin(g, {}, prior));
  for (int call = 0; match.busy() && call < 1'000'000; ++call) match.work(units, ranges, keyframes);
  EXPECT_FALSE(match.busy());
  return match.result();
}
/// A keyframe there, as the newest.
void keep(Match& match, Keyframes& keyframes, const slam::ScanGeometry& g, const Ranges& ranges,
          const slam::GraphPose<float>& at = {}) {
  run(match, keyframes, g, ranges, motion(0, 0, 0, 0.1, 0.1));
  keyframes.add(match.scan(), at);
}

struct ScanMatching : testing::Test {
  std::mt19937 random{1};
  Match match;
  Keyframes keyframes;
};

TEST_F(ScanMatching, TheFirstScanHasNoMotion) {
  const auto& result = run(match, keyframes, kTurn, look(kRoom, kTurn, {}, 0.01, random), motion(0, 0, 0, 0.1, 0.1));
  EXPECT_EQ(result.fate, slam::ScanFate::kFirst);
  EXPECT_TRUE(keyframes.due({}));
}

TEST_F(ScanMatching, AScanAgainstItselfIsZeroAndSure) {
  const Ranges ranges = look(kRoom, kTurn, {0.3, 0.2, 0.1}, 0.01, random);
  keep(match, keyframes, kTurn, ranges);
  const auto& result = run(match, keyframes, kTurn, ranges, motion(0.05, -0.04, 0.03, 0.1, 0.1));
  ASSERT_TRUE(result.matched());
  EXPECT_NEAR(mean(result)[0], 0, 1e-3);
  EXPECT_NEAR(mean(result)[1], 0, 1e-3);
  EXPECT_NEAR(mean(result)[2], 0, 5e-4);
  // 360 distances of 0.02 m, half of them along each axis: 0.02 / sqrt(180).
  for (int i = 0; i < 2; ++i) {
    EXPECT_GT(std::sqrt(covariance(result)(i, i)), 0.7 * 0.02 / std::sqrt(180.0));
    EXPECT_LT(std::sqrt(covariance(result)(i, i)), 2.0 * 0.02 / std::sqrt(180.0));
  }
}

TEST_F(ScanMatching, ACorridorKeepsThePriorsVarianceAlongItself) {
  for (const double yaw : {0.0, 0.7, 2.0}) {
    Keyframes frames;
    keep(match, frames, kTurn, look(kCorridor, kTurn, {0, 0, yaw}, 0.01, random));
    const Ranges ranges = look(kCorridor, kTurn, {0.2, 0.05, yaw + 0.05}, 0.01, random);
    const double c = std::cos(yaw), s = std::sin(yaw);
    const auto& result = run(match, frames, kTurn, ranges, motion(c * 0.25, -s * 0.25, 0.03, 0.2, 0.1));
    ASSERT_TRUE(result.matched());
    const Eigen::Vector3d along(c, -s, 0), across(s, c, 0);  // of the corridor, in the keyframe
    EXPECT_GE(along.dot(covariance(result) * along), 0.9 * 0.04) << yaw;
    EXPECT_LE(across.dot(covariance(result) * across), 1e-4) << yaw;
    EXPECT_NEAR(across.dot(mean(result)), 0.05, 0.01) << yaw;
    EXPECT_NEAR(along.dot(mean(result)), 0.25, 0.03) << "odometry's";
  }
}

TEST_F(ScanMatching, AClockwiseScannerGivesTheMirroredBits) {
  const Ranges before = look(kRoom, kTurn, {}, 0.01, random), now = look(kRoom, kTurn, {0.2, 0.1, 0.2}, 0.01, random);
  slam::ScanGeometry other = kTurn;
  other.first_rad = -kTurn.first_rad, other.step_rad = -kTurn.step_rad;
  keep(match, keyframes, kTurn, before);
  const auto a = run(match, keyframes, kTurn, now, motion(0.1, 0.05, 0.1, 0.2, 0.1));
  Keyframes mirrored;
  keep(match, mirrored, other, before);
  const auto b = run(match, mirrored, other, now, motion(0.1, -0.05, -0.1, 0.2, 0.1));
  ASSERT_TRUE(a.matched());
  EXPECT_EQ(a.pose.mean.x_m, b.pose.mean.x_m);
  EXPECT_EQ(a.pose.mean.y_m, -b.pose.mean.y_m);
  EXPECT_EQ(a.pose.mean.yaw.turn, -b.pose.mean.yaw.turn);
  EXPECT_EQ(a.pose.covariance(0, 1), -b.pose.covariance(0, 1));
  EXPECT_NEAR(mean(a)[1], 0.1, 0.01) << "and the unmirrored one is true";
}

TEST_F(ScanMatching, AScannerTurnedOnItsMountTurnsTheResult) {
  const Ranges before = look(kRoom, kTurn, {}, 0.01, random), now = look(kRoom, kTurn, {0.2, 0.1, 0.1}, 0.01, random);
  keep(match, keyframes, kTurn, before);
  const auto a = run(match, keyframes, kTurn, now, motion(0.2, 0.1, 0.1, 0.2, 0.1));
  slam::ScanGeometry turned = kTurn;
  turned.first_rad = 0.0F;  // by half a turn
  Keyframes frames;
  keep(match, frames, turned, before, {slam::Coordinate<float>{}.plus(900), {}, slam::Heading<float>::from_radians(2)});
  const auto b = run(match, frames, turned, now, motion(-0.2, -0.1, 0.1, 0.2, 0.1));
  EXPECT_NEAR(mean(a)[0], -mean(b)[0], 5e-4);
  EXPECT_NEAR(mean(a)[1], -mean(b)[1], 5e-4);
  EXPECT_NEAR(mean(a)[2], mean(b)[2], 2e-4);
}

TEST_F(ScanMatching, WithoutAnyRangeOdometryStaysAndIsCounted) {
  keep(match, keyframes, kTurn, look(kRoom, kTurn, {}, 0.01, random));
  const Motion prior = motion(0.3, -0.1, 0.2, 0.2, 0.1);
  for (const Ranges& ranges : {Ranges(360, 0), Ranges(360, 8191), Ranges{}}) {
    const auto& result = run(match, keyframes, kTurn, ranges, prior);
    EXPECT_EQ(result.fate, slam::ScanFate::kFewPairs);
    EXPECT_EQ(result.pose.mean.x_m, prior.mean.x_m);
    EXPECT_EQ(result.pose.mean.yaw.turn, prior.mean.yaw.turn);
    EXPECT_EQ(result.pose.covariance.packed(), prior.covariance.packed());
  }
  EXPECT_EQ(match.counters().few_pairs, 3U);
  EXPECT_EQ(match.counters().matched, 0U);
}

TEST_F(ScanMatching, AScanTakenInATurnIsAScanAtRest) {
  slam::ScanGeometry sweep = kTurn;
  sweep.sweep_s = 0.1F;
  const slam::ScanMotion moves{.forward_mps = 1.0F, .left_mps = 0.2F, .yaw_rate_radps = 1.5F};
  slam::Scan<kBeams> scan, smeared;
  ASSERT_TRUE(scan.begin(sweep, moves));
  ASSERT_TRUE(smeared.begin(sweep, {}));
  double worst = 0, worst_smeared = 0;
  for (int i = 0; i < sweep.beams; ++i) {
    const double t = 0.1 * (i / 359.0 - 0.5), a = 1.5 * t;  // the arc's closed form
    const double x = (1.0 * std::sin(a) - 0.2 * (1 - std::cos(a))) / 1.5;
    const double y = (1.0 * (1 - std::cos(a)) + 0.2 * std::sin(a)) / 1.5;
    const double towards = a + bearing(sweep, i), range = cast(kRoom, x, y, towards);
    scan.place(i, range_steps(range));
    smeared.place(i, range_steps(range));
    const double hit_x = x + range * std::cos(towards), hit_y = y + range * std::sin(towards);
    const auto off = [&](const auto& of) {
      const auto& p = of.point[static_cast<std::size_t>(i)];
      return std::hypot(1e-3 * p.x_mm - hit_x, 1e-3 * p.y_mm - hit_y);
    };
    worst = std::max(worst, off(scan));
    worst_smeared = std::max(worst_smeared, off(smeared));
  }
  EXPECT_LT(worst, 0.0035) << "half a step of range and of a point";
  EXPECT_GT(worst_smeared, 0.2);
}

TEST_F(ScanMatching, TheResultIsTheSameHoweverTheUnitsAreDealt) {
  keep(match, keyframes, kTurn, look(kRoom, kTurn, {}, 0.01, random));
  const Ranges now = look(kRoom, kTurn, {0.2, 0.1, 0.2}, 0.01, random);
  const auto whole = run(match, keyframes, kTurn, now, motion(0.1, 0, 0, 0.2, 0.2));
  const auto sliced = run(match, keyframes, kTurn, now, motion(0.1, 0, 0, 0.2, 0.2), 7);
  EXPECT_EQ(whole.pose.mean.x_m, sliced.pose.mean.x_m);
  EXPECT_EQ(whole.pose.mean.yaw.turn, sliced.pose.mean.yaw.turn);
  EXPECT_EQ(whole.pose.covariance.packed(), sliced.pose.covariance.packed());
}

TEST_F(ScanMatching, ATurnThatOdometryMissedIsFound) {
  Match near({.reach_first_m = 0.15F});  // too near for the iterations alone
  keep(near, keyframes, kTurn, look(kRoom, kTurn, {}, 0.01, random));
  for (const double yaw : {-0.45, -0.2, 0.3, 0.45}) {
    const auto& result =
        run(near, keyframes, kTurn, look(kRoom, kTurn, {0.1, 0, yaw}, 0.01, random), motion(0.1, 0, 0, 0.1, 0.2));
    ASSERT_TRUE(result.matched());
    EXPECT_NEAR(mean(result)[2], yaw, 5e-3);
  }
}

TEST_F(ScanMatching, WhatIsNoScannerIsRefused) {
  const Motion prior = motion(0, 0, 0, 0.1, 0.1);
  const float nan = base::kNan;
  for (const slam::ScanGeometry& g :
       {slam::ScanGeometry{}, slam::ScanGeometry{.beams = kBeams + 1, .step_rad = 0.01F},
        slam::ScanGeometry{.beams = 100}, slam::ScanGeometry{.beams = 100, .step_rad = nan},
        slam::ScanGeometry{.beams = 100, .step_rad = 0.01F, .max_m = nan}})
    EXPECT_FALSE(match.begin(g, {}, prior));
  EXPECT_FALSE(match.begin(kTurn, {.yaw_rate_radps = nan}, prior));
  EXPECT_FALSE(match.begin(kTurn, {}, motion(std::nan(""), 0, 0, 0.1, 0.1)));
  EXPECT_FALSE(match.begin(kTurn, {}, motion(0, 0, 0, 0.0, 0.1))) << "no covariance";
  EXPECT_FALSE(match.busy());
}

TEST_F(ScanMatching, TheCovarianceIsThatOfTheErrors) {
  // Noise of 0.014 m in each scan: 0.02 m between them, as the options state.
  constexpr int kRuns = 150;
  std::normal_distribution<double> normal;
  double nees = 0;
  for (int k = 0; k < kRuns; ++k) {
    const Place a{normal(random), 0.8 * normal(random), 3 * normal(random)};
    const double x = 0.15 * normal(random), y = 0.15 * normal(random), yaw = 0.1 * normal(random);
    const Place b{a.x + std::cos(a.yaw) * x - std::sin(a.yaw) * y, a.y + std::sin(a.yaw) * x + std::cos(a.yaw) * y,
                  a.yaw + yaw};
    Keyframes frames;
    keep(match, frames, kTurn, look(kRoom, kTurn, a, 0.014, random));
    const Motion prior =
        motion(x + 0.05 * normal(random), y + 0.05 * normal(random), yaw + 0.03 * normal(random), 0.05, 0.03);
    const auto& result = run(match, frames, kTurn, look(kRoom, kTurn, b, 0.014, random), prior);
    ASSERT_TRUE(result.matched());
    const Eigen::Vector3d e = mean(result) - Eigen::Vector3d(x, y, yaw);
    nees += e.dot(covariance(result).llt().solve(e)) / kRuns;
  }
  std::printf("NEES of 3: %.2f\n", nees);
  EXPECT_GT(nees, 2.0);
  EXPECT_LT(nees, 5.0);
}

}  // namespace
}  // namespace tetap
