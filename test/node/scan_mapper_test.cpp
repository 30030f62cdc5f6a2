// SPDX-License-Identifier: Apache-2.0
// Graph-SLAM by a scanner alone, as frames in and frames out: MRPT's simulated drive with its true poses, a given
// pose, a reset, and memory.
#include "tetap/estimators/mapping/scan_mapper.hpp"
#include "config/parameters/scanner_map.hpp"
#include "scan_robot.hpp"
#include "support/scan_room.hpp"

#include <gtest/gtest.h>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>

namespace tetap::test {
namespace {

using Robot = node::Estimators<estimators::Odometry, estimators::ScanMapper192>;
using Driven = DrivenOf<Robot>;
static_assert(Robot::kMakesMap && estimators::MapsKeyframes<estimators::ScanMapper192> &&
              estimators::MatchesScans<estimators::ScanMapper192> && node::RecordsLater<estimators::ScanMapper192> &&
              node::WorksInJobs<estimators::ScanMapper192>);
static_assert(sizeof(node::Node<Robot>) < 224 * 1024, "an image of 256 kB holds it with stack and drivers");

/// Two laps of a circle of 1 m in the room, 0.5 m/s, with wheels that state a tenth too much and a turn that is wrong.
struct Laps {
  Driven node{[] {
    param::Parameters n = robot::scanner_map::parameters;
    n.lidar.x_b_m = 0.2F, n.lidar.turn_us = 0;
    return n;
  }()};
  double angle = 0;

  void drive(double until) {
    constexpr float kStep = 0.0174533F;
    for (; angle < until; angle += 0.005) {
      const int k = static_cast<int>(std::lround(angle / 0.005));
      Frames frames;
      if (k % 10 == 0) {
        const double yaw = angle + std::numbers::pi / 2;
        std::vector<std::uint16_t> ranges;
        for (int i = 0; i < 360; ++i)
          ranges.push_back(
              range_steps(cast(kRoom, std::cos(angle) + 0.2 * std::cos(yaw), std::sin(angle) + 0.2 * std::sin(yaw),
                               yaw - 3.1415 + static_cast<double>(kStep) * i)));
        node.scans = static_cast<std::size_t>(k / 10);
        frames = scan_frames(node.bench.now_us, k / 10, ranges, -3.1415F, kStep);
      }
      node.tick(frames, 0.55F, 0.52F);
    }
  }
  /// The place in the frame of the start, whose x axis points along the circle.
  [[nodiscard]] Place truth() const { return {std::sin(angle), 1 - std::cos(angle), angle}; }
};

TEST(ScanMapper, ClosesTheLoopsOfARoomInItsFreeTicks) {
  const auto laps = std::make_unique<Laps>();
  laps->drive(4 * std::numbers::pi);
  const Place truth = laps->truth();
  std::printf("two laps: %.3f m off, %d closures, sigma %.3f m\n",
              std::hypot(laps->node.x_m - truth.x, laps->node.y_m - truth.y), laps->node.graph.closures,
              static_cast<double>(laps->node.sigma.std_x_m));
  EXPECT_NEAR(laps->node.x_m, truth.x, 0.05);
  EXPECT_NEAR(laps->node.y_m, truth.y, 0.05);
  EXPECT_GT(laps->node.graph.closures, 8);
  EXPECT_EQ(laps->node.graph.status, bus::GraphStatus::kConverged);
  EXPECT_LT(laps->node.sigma.std_x_m, 0.1F);
}

TEST(ScanMapper, AGivenPoseMovesTheMapAndAResetForgetsIt) {
  const auto laps = std::make_unique<Laps>();
  laps->drive(5.0);
  Driven& node = laps->node;
  const auto distance = [&] {
    const auto &a = node.keyframes[1], &b = node.keyframes[10];
    return std::hypot(a.x_m - b.x_m, a.y_m - b.y_m);
  };
  for (int i = 0; i < 100; ++i) node.tick({}, 0, 0);
  const double before = distance();
  node.tick(set_pose(1, 40'000, -7'000, 1.0F, 0.1F, 0.05F), 0, 0);
  EXPECT_NEAR(node.x_m, 40, 0.01);
  EXPECT_NEAR(node.y_m, -7, 0.01);
  EXPECT_NEAR(node.yaw_rad, 1.0, 0.01);
  EXPECT_NEAR(node.sigma.std_x_m, 0.1, 0.02);
  for (int i = 0; i < 100; ++i) node.tick({}, 0, 0);
  EXPECT_NEAR(distance(), before, 0.03) << "rigidly";
  EXPECT_GT(node.keyframes[10].x_m, 35);
  node.tick({in(bus::protect(bus::CmdReset{.ctr = 5, .what = bus::ResetWhat::kOwnMap}))}, 0, 0);
  for (int i = 0; i < 100; ++i) node.tick({}, 0, 0);
  EXPECT_EQ(node.map.map_size, 1);
  EXPECT_NEAR(node.x_m, 40, 0.02);
  laps->drive(6.0);
  EXPECT_GT(node.map.map_size, 2);
  EXPECT_EQ(node.matches.back().fate, bus::ScanFate::kMatched);
}

TEST(ScanMapper, IsTheSameInARepetition) {
  const auto a = std::make_unique<Laps>(), b = std::make_unique<Laps>();
  a->drive(8.0);
  b->drive(8.0);
  EXPECT_EQ(a->node.crcs, b->node.crcs);
}

struct Simul : testing::Test {
  std::vector<Row> rows, truth;
  param::Parameters numbers = recorded(robot::scanner_map::parameters);

  void SetUp() override {
    const std::string name = imported_scans("simul.rawlog", "--truth", "simul.rawlog.GT.txt");
    if (name.empty()) GTEST_SKIP() << "scans/simul.rawlog is not in $TETAP_DATA";
    rows = read_rows(name + ".scans"), truth = read_rows(name + ".truth");
    ASSERT_EQ(rows.size(), truth.size() + 1) << name;
    numbers.lidar.x_b_m = 0.2F;                                                            // scanner_b of the log
    numbers.mapping.keyframe_distance_m = 1.0F, numbers.mapping.keyframe_turn_rad = 0.4F;  // a yard of 80 m
  }
};

TEST_F(Simul, OwnClosuresHoldTheMapOverTwoHundredMetres) {
  const auto node = std::make_unique<Driven>(numbers);
  const std::vector<Place> track = replayed(*node, rows);
  double worst_m = 0, worst_rad = 0;
  for (std::size_t k = 0; k < track.size(); ++k) {
    worst_m = std::max(worst_m, std::hypot(track[k].x - truth[k][0], track[k].y - truth[k][1]));
    worst_rad = std::max(worst_rad, std::abs(std::remainder(track[k].yaw - truth[k][2], 2 * std::numbers::pi)));
  }
  for (int i = 0; i < 1'000; ++i) node->tick({}, 0, 0);  // the graph comes round
  double map_m = 0;
  int held = 0;
  for (const auto& [id, k] : node->keyframes) {
    if (k.seen < node->bench.now_us - 8'000'000 || k.scan == 0) continue;
    ++held;
    map_m = std::max(map_m, std::hypot(k.x_m - truth[k.scan - 1][0], k.y_m - truth[k.scan - 1][1]));
  }
  std::printf("simul: the robot at most %.3f m, %.2f deg off; %d of %zu keyframes held, at most %.3f m off\n", worst_m,
              worst_rad * 180 / std::numbers::pi, held, node->keyframes.size(), map_m);
  EXPECT_LE(worst_m, 0.8) << "before the loops are closed";
  EXPECT_LE(worst_rad * 180 / std::numbers::pi, 2.0);
  EXPECT_LE(map_m, 0.3);
  EXPECT_GT(held, 60);
}

}  // namespace
}  // namespace tetap::test
