// SPDX-License-Identifier: Apache-2.0
// Closures found by the matcher itself: in a room that is driven round, in a corridor that looks the same everywhere,
// and in the Intel Research Lab with the memory of a small node.
#include "tetap/slam/scan_closures.hpp"
#include "slam/scan_world.hpp"
#include "support/imported_scans.hpp"

#include <gtest/gtest.h>
#include <Eigen/Core>
#include <cstdio>
#include <memory>

namespace tetap {
namespace {

using namespace test;

/// A robot that drives a circle of 1 m twice, 36 keyframes a lap, with a yaw that odometry has wrong by 5 mrad a step.
/// Its scanner sits 0.2 m ahead, turned to the left.
template <int kKept = 181, int kScans = 128>
struct Circle {
  using Graph = slam::KeyframeGraph<float, 128, 320, 1600, 128>;
  static constexpr int kSteps = 72;
  std::unique_ptr<Graph> graph = std::make_unique<Graph>();
  std::unique_ptr<slam::ScanClosures<360, kKept, kScans>> closures =
      std::make_unique<slam::ScanClosures<360, kKept, kScans>>();
  slam::ScanMatch<360, 4> match;
  slam::ScanKeyframes<360, 4> none;
  std::mt19937 random{1};

  explicit Circle(const std::vector<Wall>& walls, int units = 100) {
    const Motion mounting = motion(0.2, 0, M_PI / 2, 0, 0);
    const double turn = 2 * M_PI / 36, chord = 2 * std::sin(turn / 2);
    for (int k = 0; k <= kSteps; ++k) {
      const double yaw = turn * k + M_PI / 2;
      const Place at{std::cos(turn * k) + 0.2 * std::cos(yaw), std::sin(turn * k) + 0.2 * std::sin(yaw),
                     yaw + M_PI / 2};
      if (k > 0)
        graph->odometry(motion(chord * std::cos(turn / 2), chord * std::sin(turn / 2), turn + 0.005, 0.02, 0.01));
      const Ranges ranges = look(walls, kTurn, at, 0.01, random);
      EXPECT_TRUE(match.begin(kTurn, {}, motion(0, 0, 0, 0.1, 0.1)));
      match.work(1000, ranges, none);
      closures->hold(kTurn, ranges, {});
      closures->add(*graph, match.scan(), mounting);
      for (int call = 0; call < 100'000 && !closures->idle(); ++call) closures->work(units, *graph);
      EXPECT_TRUE(closures->idle());
      for (int call = 0; call < 10'000 && !graph->idle(); ++call) graph->work(10'000);
    }
  }
  /// Distance of the last keyframe from the first, where it lies in truth (m).
  [[nodiscard]] double error_m() const {
    const auto d = graph->pose().minus({});
    return std::hypot(static_cast<double>(d.x_m), static_cast<double>(d.y_m));
  }
};

TEST(ScanClosures, ARoomDrivenRoundIsClosedHoweverTheUnitsAreDealt) {
  const Circle<> circle(kRoom), sliced(kRoom, 7);
  const auto& count = circle.closures->counters();
  std::printf("room: %.3f m, %u of %u taken\n", circle.error_m(), count.taken, count.tried);
  EXPECT_LT(circle.error_m(), 0.05);
  EXPECT_GT(count.taken, 50U);
  EXPECT_EQ(count.not_kept, 0U);
  EXPECT_EQ(sliced.closures->counters().taken, count.taken);
  EXPECT_EQ(sliced.graph->pose().x.rest_m, circle.graph->pose().x.rest_m);
}

TEST(ScanClosures, ACorridorClosesNothing) {
  const Circle<> circle({{-60, -2, 60, -2}, {-60, 2.5, 60, 2.5}});
  EXPECT_EQ(circle.closures->counters().taken, 0U);
  EXPECT_GT(circle.closures->counters().weak, 50U);
  EXPECT_GT(circle.error_m(), 0.2) << "odometry's";
}

TEST(ScanClosures, KeyframesWithoutPlaceAreCounted) {
  const Circle<120, 48> circle(kRoom);
  EXPECT_LE(circle.closures->counters().not_kept, 73U - 48U);
  EXPECT_GE(circle.closures->counters().not_kept, 73U - 48U - circle.graph->counters().composed_away);
  EXPECT_LT(circle.error_m(), 0.05) << "the first lap has places, of each third beam";
}

TEST(ScanClosures, AnotherScannerForgetsTheScansOfTheOneBefore) {
  Circle<> circle(kRoom);
  slam::ScanGeometry other = kTurn;
  other.beams = 180;
  circle.closures->hold(other, Ranges(180, 400), {});
  const std::uint32_t tried = circle.closures->counters().tried;
  circle.closures->add(*circle.graph, circle.match.scan(), motion(0, 0, 0, 0, 0));
  while (!circle.closures->idle()) circle.closures->work(100, *circle.graph);
  EXPECT_EQ(circle.closures->counters().tried, tried);
}

/// Graph and scans of robot scanner_map, on a node of 256 kB.
using Graph256 = slam::KeyframeGraph<float, 192, 448, 1312, 2048>;
using Closures256 = slam::ScanClosures<361, 181, 192>;
static_assert(sizeof(Graph256) + sizeof(Closures256) <= 184 * 1024);
/// Those of a node of 128 kB.
using Graph128 = slam::KeyframeGraph<float, 80, 192, 432, 1024>;
using Closures128 = slam::ScanClosures<361, 181, 80>;
static_assert(sizeof(Graph128) + sizeof(Closures128) <= 80 * 1024);
/// On a host.
using Graph2048 = slam::KeyframeGraph<float, 2048, 8192, 32768, 2048>;
using Closures2048 = slam::ScanClosures<361, 361, 2048>;

struct IntelLab : testing::Test {
  /// A scan: a displacement from a keyframe.
  struct Seen {
    std::uint32_t step;
    slam::Displacement<float> d;
  };
  std::vector<Row> rows, relations;
  slam::ScanGeometry geometry;
  std::vector<Seen> seen;
  std::vector<slam::GraphPose<float>> track;  ///< by the matcher alone

  void SetUp() override {
    const std::string name = imported_scans("intel_gfs.json.xz", "--relations", "intel.relations");
    if (name.empty()) GTEST_SKIP() << "scans is not in $TETAP_DATA";
    rows = read_rows(name + ".scans");
    relations = read_rows(name + ".relations");
    ASSERT_EQ(rows.size(), 911U) << name;
    ASSERT_EQ(relations.size(), 105U);
    geometry = {.beams = static_cast<int>(rows[0][0]),
                .first_rad = static_cast<float>(rows[0][1]),
                .step_rad = static_cast<float>(rows[0][2])};
  }
  void drive(auto& graph, auto& closures) {
    const auto match = std::make_unique<slam::ScanMatch<361, 4>>();
    const auto keyframes = std::make_unique<slam::ScanKeyframes<361, 4>>();
    slam::GraphPose<float> before;
    for (std::size_t k = 1; k < rows.size(); ++k) {
      const auto number = [&](std::size_t i) { return static_cast<float>(rows[k][i]); };
      const slam::GraphPose<float> odometry{slam::Coordinate<float>{}.plus(number(1)),
                                            slam::Coordinate<float>{}.plus(number(2)),
                                            slam::Heading<float>::from_radians(number(3))};
      const auto guess = track.empty() ? odometry : track.back().plus(odometry.minus(before));
      before = odometry;
      const slam::GraphPose<float> newest = track.empty() ? guess : keyframes->pose(0);
      const Ranges ranges(rows[k].begin() + 4, rows[k].end());
      Motion prior = motion(0, 0, 0, 0.2, 0.2);
      prior.mean = guess.minus(newest);
      ASSERT_TRUE(match->begin(geometry, {}, prior));
      for (int call = 0; call < 10'000 && match->busy(); ++call) match->work(100, ranges, *keyframes);
      const Motion& result = match->result().pose;
      const bool due = keyframes->due(result.mean);
      track.push_back(newest.plus(result.mean));
      if (due && keyframes->count() > 0) graph.odometry(closures.widened(result));
      seen.push_back({graph.step(), due ? slam::Displacement<float>{} : result.mean});
      if (!due) continue;
      keyframes->add(match->scan(), track.back());
      closures.hold(geometry, ranges, {});
      closures.add(graph, match->scan(), motion(0, 0, 0, 0, 0));
      for (int call = 0; call < 10'000 && !closures.idle(); ++call) closures.work(100, graph);
      for (int call = 0; call < 10'000 && !graph.idle(); ++call) graph.work(100'000);
    }
  }
  /// A scan by the graph: its keyframe, or the one before and the trail of those that were composed away.
  [[nodiscard]] slam::GraphPose<float> by_graph(const auto& graph, std::size_t scan) const {
    int k = graph.graph().poses() - 1;
    while (k > 0 && graph.keyframe_step(k) > seen[scan].step) --k;
    slam::GraphPose<float> pose = graph.keyframe(k);
    slam::Displacement<float> way;
    for (std::uint32_t s = graph.keyframe_step(k) + 1; s <= seen[scan].step; ++s)
      if (graph.trail(s, way)) pose = pose.plus(way);
    return pose.plus(seen[scan].d);
  }
  /// Mean errors (m, deg) of the relations whose scans are at most so far apart.
  template <class PoseOf>
  [[nodiscard]] std::array<double, 3> errors(const PoseOf& pose_of, double apart) const {
    std::array<double, 3> sum{};
    for (const Row& r : relations) {
      if (std::abs(r[1] - r[0]) > apart) continue;
      const auto d = pose_of(static_cast<std::size_t>(r[1])).minus(pose_of(static_cast<std::size_t>(r[0])));
      const Eigen::Vector3d e =
          Eigen::Vector3f(d.x_m, d.y_m, d.yaw.radians()).cast<double>() - Eigen::Vector3d(r[2], r[3], r[4]);
      sum[0] += e.head<2>().norm(), sum[1] += std::abs(std::remainder(e[2], 2 * M_PI)) * 180 / M_PI, sum[2] += 1;
    }
    return {sum[0] / sum[2], sum[1] / sum[2], sum[2]};
  }
  template <class Graph, class Closures>
  std::array<double, 3> closed(const char* name, const slam::KeyframeOptions& options = {}) {
    const auto graph = std::make_unique<Graph>(options);
    const auto closures = std::make_unique<Closures>();
    drive(*graph, *closures);
    const auto pose_of = [&](std::size_t scan) { return by_graph(*graph, scan); };
    const auto near = errors(pose_of, 3), all = errors(pose_of, 1e9);
    const auto& count = closures->counters();
    std::printf(
        "%s: neighbours %.4f m, %.3f deg; all %.3f m, %.2f deg; %u tried, %u weak, %u taken, %u refused; %d of %u "
        "keyframes held, %u composed away; graph %zu, scans %zu bytes\n",
        name, near[0], near[1], all[0], all[1], count.tried, count.weak, count.taken, count.refused,
        graph->graph().poses(), graph->step() + 1, graph->counters().composed_away, sizeof(Graph), sizeof(Closures));
    EXPECT_EQ(count.not_kept, 0U);
    EXPECT_EQ(all[2], 105);
    return all;
  }
};

TEST_F(IntelLab, RelationsByHandAreMetOpenLoopAndWithOwnClosuresIn256kB) {
  const auto all = closed<Graph256, Closures256>("256 kB");
  EXPECT_LE(all[0], 0.06);
  EXPECT_LE(all[1], 1.2);
  const auto open = [&](std::size_t scan) { return track[scan]; };
  const auto near = errors(open, 3), whole = errors(open, 1e9);
  std::printf("open loop: %.0f neighbours %.4f m, %.3f deg; %.0f relations %.3f m, %.2f deg\n", near[2], near[0],
              near[1], whole[2], whole[0], whole[1]);
  EXPECT_EQ(near[2], 78);
  EXPECT_LE(near[0], 0.014);
  EXPECT_LE(near[1], 0.45);
  EXPECT_LE(whole[0], 0.25);
  EXPECT_LE(whole[1], 1.5);
}

TEST_F(IntelLab, RelationsByHandAreMetWithOwnClosuresOnAHost) {
  const auto all = closed<Graph2048, Closures2048>("host", {.closures_a_job = 16});
  EXPECT_LE(all[0], 0.06);
  EXPECT_LE(all[1], 1.2);
}

TEST_F(IntelLab, RelationsByHandAreMetWithOwnClosuresIn128kB) {
  const auto all = closed<Graph128, Closures128>("128 kB");
  EXPECT_LE(all[0], 0.06);
  EXPECT_LE(all[1], 1.2);
}

}  // namespace
}  // namespace tetap
