// SPDX-License-Identifier: Apache-2.0
// Closures that are refused when they come: true ones are taken once others have moved the graph, false ones stay out,
// also those that agree with each other. The truth is drawn here; the judges are chi-square and the list of false ones.
#include "slam/graphs.hpp"
#include "tetap/slam/keyframe_graph.hpp"

#include <gtest/gtest.h>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <random>
#include <vector>

namespace tetap {
namespace {

using Graph = slam::KeyframeGraph<double, 2048, 4096, 16384, 2048>;

/// Two laps of a square of 60 m in steps of 1 m; every tenth step of the second lap sees the one of the first.
struct Laps {
  static constexpr int kSide = 60, kLap = 4 * kSide;
  std::vector<Eigen::Vector3d> truth;
  std::vector<test::G2oEdge> edges, mirrored;
  std::mt19937 random;
  std::normal_distribution<double> normal;

  Laps(unsigned seed, double sigma_yaw_rad) : random(seed) {
    truth.push_back(Eigen::Vector3d::Zero());
    for (int k = 0; k < 2 * kLap; ++k) {
      const Eigen::Vector3d& p = truth.back();
      truth.emplace_back(p(0) + std::cos(p(2)), p(1) + std::sin(p(2)), p(2) + (k % kSide == kSide - 1 ? M_PI / 2 : 0));
    }
    for (int k = 1; k < static_cast<int>(truth.size()); ++k)
      edges.push_back(drawn(k - 1, k, {0.02, 0.02, sigma_yaw_rad}));
    for (int k = kLap + 5; k < static_cast<int>(truth.size()); k += 10) edges.push_back(drawn(k - kLap, k, kSeen));
    // The second side looks like the last but one: ten poses of it are seen in place of poses there.
    for (int k = 0; k < 10; ++k) mirrored.push_back(noisy(2 * kSide + 5 + 3 * k, kLap + 5 + 3 * k, {0, 0, 0}, kSeen));
  }
  [[nodiscard]] int true_closures() const { return static_cast<int>(edges.size()) - 2 * kLap; }

 private:
  inline static const Eigen::Vector3d kSeen{0.05, 0.05, 0.01};
  test::G2oEdge noisy(int from, int to, const Eigen::Vector3d& z, const Eigen::Vector3d& sigma) {
    const Eigen::Vector3d e(sigma(0) * normal(random), sigma(1) * normal(random), sigma(2) * normal(random));
    Eigen::Matrix3d covariance = sigma.cwiseAbs2().asDiagonal(), turn = Eigen::Matrix3d::Identity();
    turn.topLeftCorner<2, 2>() = test::rotation(z(2) + e(2));  // g2o's information is in the axes of the end
    return {from, to, z + e, (turn.transpose() * covariance * turn).inverse()};
  }
  test::G2oEdge drawn(int from, int to, const Eigen::Vector3d& sigma) {
    const Eigen::Vector3d &a = truth[static_cast<std::size_t>(from)], &b = truth[static_cast<std::size_t>(to)];
    Eigen::Vector3d z;
    z << test::rotation(-a(2)) * (b - a).head<2>(), b(2) - a(2);
    return noisy(from, to, z, sigma);
  }
};

struct Outcome {
  int true_ones = 0, false_ones = 0;  ///< closures that count in the end
  double chi2 = 0;                    ///< sum over all edges that are true
  slam::KeyframeCounters count;
};

bool counts(const Graph& graph, const test::G2oEdge& edge) {
  for (int e = 0; e < graph.graph().edges(); ++e) {
    const auto& one = graph.graph().edge(e);
    if (one.closure != 0 && one.refused == 0 && static_cast<int>(one.from) == edge.from &&
        static_cast<int>(one.to) == edge.to && std::abs(one.z.x_m - edge.z(0)) + std::abs(one.z.y_m - edge.z(1)) < 1e-3)
      return true;
  }
  return false;
}

/// Edges in the order of their later pose, with so many units of work at each.
Outcome run(const std::vector<test::G2oEdge>& edges, const std::vector<test::G2oEdge>& more, int closures_a_job) {
  const auto graph = std::make_unique<Graph>(slam::KeyframeOptions{.closures_a_job = closures_a_job});
  std::vector<test::G2oEdge> all = edges;
  all.insert(all.end(), more.begin(), more.end());
  std::stable_sort(all.begin(), all.end(),
                   [](const auto& a, const auto& b) { return std::max(a.from, a.to) < std::max(b.from, b.to); });
  for (const auto& edge : all) {
    const auto from = static_cast<std::uint32_t>(edge.from), to = static_cast<std::uint32_t>(edge.to);
    if (edge.to == edge.from + 1)
      EXPECT_TRUE(graph->odometry(test::motion_of<double>(edge)));
    else
      graph->closure(from, to, test::motion_of<double>(edge));
    graph->work(10'000'000);
  }
  graph->optimise();
  for (int call = 0; !graph->idle() && call < 10'000; ++call) graph->work(10'000'000);
  EXPECT_TRUE(graph->idle()) << "jobs and trials end";
  EXPECT_EQ(graph->graph().status(), slam::GraphStatus::kConverged);
  Outcome found{.count = graph->counters()};
  for (const auto& edge : edges) {
    found.chi2 +=
        test::g2o_chi2(edge, test::vector_of(graph->keyframe(edge.from)), test::vector_of(graph->keyframe(edge.to)));
    if (edge.to != edge.from + 1) found.true_ones += counts(*graph, edge) ? 1 : 0;
  }
  for (const auto& edge : more) found.false_ones += counts(*graph, edge) ? 1 : 0;
  return found;
}

/// Three equations a closure are left over: the sum of squares is chi-square with so many degrees.
void expect_optimum(const Outcome& found, int closures) {
  const double degrees = 3.0 * closures, sigma = std::sqrt(2 * degrees);
  EXPECT_EQ(found.true_ones, closures);
  EXPECT_LT(found.chi2, degrees + 5 * sigma);
  EXPECT_GT(found.chi2, degrees - 5 * sigma);
}

TEST(RefusedClosures, AreTakenOnceOthersHaveMovedAGraphThatBeganFarOff) {
  std::uint32_t later = 0;
  for (unsigned seed = 1; seed <= 10; ++seed) {
    const Laps laps(seed, 0.05);
    const Outcome found = run(laps.edges, {}, 1);
    expect_optimum(found, laps.true_closures());
    later += found.count.taken_later;
  }
  EXPECT_GT(later, 0U) << "some seed begins so far off that a true closure is refused at first";
}

TEST(RefusedClosures, OfAMirroredCorridorThatAgreeStayRefused) {
  for (unsigned seed = 1; seed <= 10; ++seed)
    for (const double sigma_yaw_rad : {0.005, 0.02}) {
      const Laps laps(seed, sigma_yaw_rad);
      const Outcome found = run(laps.edges, laps.mirrored, 1);
      expect_optimum(found, laps.true_closures());
      EXPECT_EQ(found.false_ones, 0) << seed << " " << sigma_yaw_rad;
    }
}

TEST(RefusedClosures, OfManyFalseOnesNextToNoneIsTakenAndTrueOnesAre) {
  for (const int false_ones : {10, 30, 100}) {
    int most = 0, least = 1000, all = 0;
    for (unsigned seed = 1; seed <= (false_ones == 100 ? 3U : 10U); ++seed) {
      const Laps laps(seed, 0.02);
      const test::G2oGraph file{.poses = static_cast<int>(laps.truth.size()), .edges = laps.edges};
      const Outcome found = run(laps.edges, test::false_closures(file, false_ones, seed), 1);
      most = std::max(most, found.false_ones);
      least = std::min(least, found.true_ones);
      all = laps.true_closures();
    }
    std::printf("%d false closures: at most %d taken, of %d true ones at least %d\n", false_ones, most, all, least);
    EXPECT_LE(most, false_ones == 100 ? 2 : 0);
    EXPECT_GE(least, 0.95 * all);
  }
}

TEST(RefusedClosures, OfAPublicGraphAreTheFalseOnes) {
  const std::string path = test::posegraph_path("CSAIL.g2o");
  if (path.empty()) GTEST_SKIP() << "CSAIL.g2o is not in $TETAP_DATA/posegraph";
  const auto file = test::read_g2o(path);
  for (const int false_ones : {0, 30}) {
    const Outcome found = run(file.edges, test::false_closures(file, false_ones, 1), 5);
    EXPECT_EQ(found.false_ones, 0);
    EXPECT_NEAR(found.chi2, 40.5551288, 0.005 * 40.5551288) << "the published optimum";
  }
}

}  // namespace
}  // namespace tetap
