// SPDX-License-Identifier: Apache-2.0
#include "tetap/slam/keyframe_graph.hpp"
#include "slam/graphs.hpp"

#include <gtest/gtest.h>
#include <algorithm>
#include <limits>
#include <memory>

namespace tetap {
namespace {

/// Robots of the 128 kB and the 64 kB class.
using Graph256 = slam::KeyframeGraph<float, 256, 640, 1600, 3584>;
using Graph128 = slam::KeyframeGraph<float, 128, 320, 800, 1536>;
static_assert(sizeof(Graph256) <= 128 * 1024);
static_assert(sizeof(Graph128) <= 64 * 1024);

using Tiny = slam::KeyframeGraph<float, 32, 64, 300, 100>;

Tiny::Motion motion(float x, float y, float yaw, float sigma = 0.05F) {
  Tiny::Motion m;
  m.mean = {x, y, slam::Heading<float>::from_radians(yaw)};
  m.covariance = filter::Symmetric<float, 3>::diagonal({sigma * sigma, sigma * sigma, 0.04F * sigma * sigma});
  return m;
}
template <class Graph>
void finish(Graph& graph) {
  graph.optimise();
  for (int call = 0; !graph.idle(); ++call) {
    ASSERT_LT(call, 200'000) << "jobs end";
    graph.work(100'000);
  }
}
bool finite(const Tiny::Pose& pose) { return base::is_finite(pose.x.rest_m) && base::is_finite(pose.y.rest_m); }

TEST(KeyframeGraph, AStepOfWayOrTurnMakesAKeyframe) {
  const auto graph = std::make_unique<Tiny>(slam::KeyframeOptions{.distance_m = 1.0F, .turn_rad = 0.5F});
  for (int i = 0; i < 9; ++i) graph->odometry(motion(0.1F, 0, 0));
  EXPECT_EQ(graph->graph().poses(), 1);
  EXPECT_NEAR(graph->pose().x.metres(), 0.9F, 1e-5F) << "the way since the last keyframe counts";
  graph->odometry(motion(0.11F, 0, 0));
  EXPECT_EQ(graph->graph().poses(), 2);
  EXPECT_EQ(graph->keyframe_step(1), 10U);
  graph->odometry(motion(0, 0, 0.51F));
  EXPECT_EQ(graph->graph().poses(), 3);
}

TEST(KeyframeGraph, AClosureBetweenKeyframesMovesAsIfTheyWereThere) {
  // The same world with a keyframe at each step, and at each fourth: the end comes to the same place.
  const auto fine = std::make_unique<Tiny>();
  const auto coarse = std::make_unique<Tiny>(slam::KeyframeOptions{.distance_m = 3.9F, .turn_rad = 10.0F});
  for (const auto& graph : {fine.get(), coarse.get()}) {
    for (int i = 0; i < 24; ++i) graph->odometry(motion(1.0F, 0, 0.02F));
    // The end is seen 0.3 m beside where odometry has it.
    slam::GraphPose<float> at_2{}, at_end{};
    const auto step = motion(1.0F, 0, 0.02F).mean;
    for (int i = 0; i < 2; ++i) at_2 = at_2.plus(step);
    for (int i = 0; i < 23; ++i) at_end = at_end.plus(step);
    auto z = motion(0, 0, 0, 0.01F);
    z.mean = at_end.minus(at_2);
    z.mean.y_m += 0.3F;
    EXPECT_TRUE(graph->closure(2, 23, z));
    finish(*graph);
    EXPECT_EQ(graph->graph().status(), slam::GraphStatus::kConverged);
  }
  EXPECT_LT(coarse->graph().poses(), 9);
  const Eigen::Vector3d e = test::vector_of(fine->pose()) - test::vector_of(coarse->pose());
  EXPECT_LT(e.head<2>().norm(), 0.15) << "half of what the closure moves";
  slam::GraphPose<float> odometry{};
  for (int i = 0; i < 24; ++i) odometry = odometry.plus(motion(1.0F, 0, 0.02F).mean);
  const double moved = (test::vector_of(coarse->pose()) - test::vector_of(odometry)).head<2>().norm();
  EXPECT_GT(moved, 0.2);
  EXPECT_LT(moved, 0.5);
}

TEST(KeyframeGraph, TenTimesMoreThanFitsWithFalseClosuresSetPoseAndReset) {
  std::mt19937 random(11);
  std::normal_distribution<float> normal;
  const auto graph = std::make_unique<Tiny>();
  for (int life = 0; life < 2; ++life) {
    for (std::uint32_t step = 1; step <= 320; ++step) {
      ASSERT_TRUE(graph->odometry(motion(1.0F + 0.02F * normal(random), 0, step % 5 == 0 ? 1.5708F : 0.0F)));
      if (step > 20) {  // the same place, a lap ago
        auto z = motion(0.05F * normal(random), 0.05F * normal(random), 0.01F * normal(random));
        graph->closure(step - 20, step, z);
      }
      if (step % 7 == 0)
        graph->closure(static_cast<std::uint32_t>(random() % step), step,
                       motion(9.0F * normal(random), 3.0F, normal(random)));
      graph->work(3'000);
      if (step == 200) {
        graph->set_pose({.x = slam::Coordinate<float>{}.plus(50.0F), .yaw = slam::Heading<float>::from_radians(1.0F)});
        EXPECT_NEAR(graph->pose().x.metres(), 50.0F, 1e-3F);
        EXPECT_NEAR(graph->pose().yaw.radians(), 1.0F, 1e-5F);
      }
      ASSERT_LE(graph->graph().poses(), 32);
      ASSERT_LE(graph->graph().edges(), 64);
      ASSERT_TRUE(finite(graph->pose()));
    }
    finish(*graph);
    const auto& count = graph->counters();
    EXPECT_GE(count.composed_away + count.skipped, 289U * static_cast<unsigned>(life + 1)) << "320 steps, 31 kept";
    EXPECT_GT(count.composed_away, 20U);
    EXPECT_GT(graph->graph().merged(), 10U);
    EXPECT_GT(count.contradicted, 0U);
    EXPECT_GE(count.jobs, 2U) << "jobs give way to closures without room, but not twice in a row";
    graph->reset();
    EXPECT_EQ(graph->graph().poses(), 1);
    EXPECT_EQ(graph->graph().edges(), 0);
    EXPECT_EQ(graph->pose().x.metres(), 0.0F);
  }
}

TEST(KeyframeGraph, ResetDuringAJobAbortsIt) {
  const auto graph = std::make_unique<Tiny>();
  for (int i = 0; i < 20; ++i) graph->odometry(motion(1, 0, 0.3F));
  ASSERT_TRUE(graph->closure(0, 20, motion(graph->pose().x.metres(), graph->pose().y.metres(), -0.2831853F)));
  graph->work(10);
  ASSERT_FALSE(graph->idle());
  graph->reset();
  EXPECT_TRUE(graph->idle());
  EXPECT_EQ(graph->counters().jobs_aborted, 1U);
  EXPECT_TRUE(graph->odometry(motion(1, 0, 0)));
  EXPECT_EQ(graph->graph().poses(), 2);
}

TEST(KeyframeGraph, StepsLongGoneAndBadInputAreCounted) {
  const auto graph = std::make_unique<Tiny>();
  for (int i = 0; i < 300; ++i) graph->odometry(motion(1, 0, 0));
  EXPECT_FALSE(graph->closure(400, 3, motion(1, 0, 0))) << "no such step yet";
  std::uint32_t between = 1;
  while (between == graph->keyframe_step(1) || between == 0) ++between;
  EXPECT_FALSE(graph->closure(between, 300, motion(299, 0, 0))) << "beyond the trail, and no keyframe";
  EXPECT_EQ(graph->counters().unknown, 2U);
  EXPECT_FALSE(graph->odometry(motion(std::numeric_limits<float>::quiet_NaN(), 0, 0)));
  EXPECT_FALSE(graph->closure(290, 300, motion(1, 0, 0, 0.0F)));
  EXPECT_EQ(graph->counters().invalid, 2U);
  EXPECT_EQ(graph->step(), 300U);
}

TEST(KeyframeGraph, AFalseClosureThatOdometryContradictsIsRefused) {
  const auto graph = std::make_unique<Tiny>();
  for (int i = 0; i < 20; ++i) graph->odometry(motion(1, 0, 0));
  EXPECT_FALSE(graph->closure(2, 12, motion(0, 0, 0)));
  EXPECT_EQ(graph->counters().contradicted, 1U);
  EXPECT_TRUE(graph->closure(2, 12, motion(10.1F, 0.1F, 0)));
}

struct Bar {
  const char* file;
  double rmse_m;
};

/// The file's measurements in the order of their later pose, false closures between them.
double rmse_of_256(const std::string& path, int false_ones, slam::KeyframeCounters& counters) {
  const auto file = test::read_g2o(path);
  const auto full = std::make_unique<slam::PoseGraph<double, 2048, 4096, 16384>>(slam::GraphOptions{.robust = false});
  std::vector<test::G2oEdge> edges = file.edges, more = test::false_closures(file, false_ones, 1);
  for (const auto& edge : edges) {
    if (edge.to != edge.from + 1) continue;
    EXPECT_TRUE(full->append(test::motion_of<double>(edge)));
  }
  for (const auto& edge : edges) {
    if (edge.to == edge.from + 1) continue;
    EXPECT_TRUE(full->close(edge.from, edge.to, test::motion_of<double>(edge)));
  }
  EXPECT_TRUE(full->begin());
  while (full->busy()) full->work(1'000'000);
  edges.insert(edges.end(), more.begin(), more.end());
  std::stable_sort(edges.begin(), edges.end(),
                   [](const auto& a, const auto& b) { return std::max(a.from, a.to) < std::max(b.from, b.to); });
  const auto graph = std::make_unique<Graph256>(slam::KeyframeOptions{.closures_a_job = 20});
  for (const auto& edge : edges) {
    if (edge.to == edge.from + 1) {
      EXPECT_TRUE(graph->odometry(test::motion_of<float>(edge)));
      graph->work(10'000'000);
    } else {
      graph->closure(static_cast<std::uint32_t>(edge.from), static_cast<std::uint32_t>(edge.to),
                     test::motion_of<float>(edge));
    }
  }
  finish(*graph);
  EXPECT_EQ(graph->graph().status(), slam::GraphStatus::kConverged);
  std::vector<Eigen::Vector3d> kept, expected;
  for (int k = 0; k < graph->graph().poses(); ++k) {
    kept.push_back(test::vector_of(graph->keyframe(k)));
    expected.push_back(test::vector_of(full->pose(static_cast<int>(graph->keyframe_step(k)))));
  }
  counters = graph->counters();
  return test::aligned_rmse(kept, expected);
}

TEST(KeyframeGraph, InMemoryOf128KbAPublicGraphEndsNearTheFullOptimum) {
  for (const Bar& bar : {Bar{"CSAIL.g2o", 0.09}}) {
    const std::string path = test::posegraph_path(bar.file);
    if (path.empty()) GTEST_SKIP() << bar.file << " is not in $TETAP_DATA/posegraph";
    for (const int false_ones : {0, 100}) {
      slam::KeyframeCounters counters;
      const double rmse = rmse_of_256(path, false_ones, counters);
      std::printf("%s with %d false closures: %.3f m; refused as false %u, without room %u\n", bar.file, false_ones,
                  rmse, counters.contradicted, counters.refused);
      EXPECT_LT(rmse, bar.rmse_m) << bar.file << " with " << false_ones;
      EXPECT_GE(counters.contradicted + 2, static_cast<unsigned>(false_ones));
    }
  }
}

}  // namespace
}  // namespace tetap
