// SPDX-License-Identifier: Apache-2.0
// Public pose graphs, all poses in memory: the optimum that GTSAM, g2o and a textbook solver agree on, with and without
// false closures. Skipped where the data is missing.
#include "slam/graphs.hpp"
#include "tetap/slam/pose_graph.hpp"

#include <gtest/gtest.h>
#include <chrono>
#include <cstdio>
#include <memory>

namespace tetap {
namespace {

struct Known {
  const char* file;
  double chi2;
};
constexpr Known kKnown[] = {
    {"intel.g2o", 45.0046958}, {"CSAIL.g2o", 40.5551288}, {"ring.g2o", 11.1631008}, {"M3500.g2o", 137.912951}};

template <class Graph>
void fill(Graph& graph, const test::G2oGraph& file, const std::vector<test::G2oEdge>& more = {}) {
  using Scalar = typename Graph::Scalar;
  for (int i = 1; i < file.poses; ++i)
    for (const auto& edge : file.edges) {
      if (edge.from != i - 1 || edge.to != i) continue;
      ASSERT_TRUE(graph.append(test::motion_of<Scalar>(edge)));
    }
  for (const auto& edge : file.edges) {
    if (edge.to == edge.from + 1) continue;
    ASSERT_TRUE(graph.close(edge.from, edge.to, test::motion_of<Scalar>(edge)));
  }
  for (const auto& edge : more) ASSERT_TRUE(graph.close(edge.from, edge.to, test::motion_of<Scalar>(edge)));
}
template <class Graph>
void run(Graph& graph) {
  ASSERT_TRUE(graph.begin());
  for (int call = 0; graph.busy(); ++call) {
    ASSERT_LT(call, 100'000) << "a job ends";
    graph.work(1'000'000);
  }
}
template <class Graph>
std::vector<Eigen::Vector3d> track_of(const Graph& graph) {
  std::vector<Eigen::Vector3d> track;
  for (int i = 0; i < graph.poses(); ++i) track.push_back(test::vector_of(graph.pose(i)));
  return track;
}
double chi2_of(const test::G2oGraph& file, const std::vector<Eigen::Vector3d>& track) {
  double sum = 0;
  for (const auto& edge : file.edges)
    sum += test::g2o_chi2(edge, track[static_cast<std::size_t>(edge.from)], track[static_cast<std::size_t>(edge.to)]);
  return sum;
}

template <class Scalar>
class PosegraphData : public testing::Test {};
using Scalars = testing::Types<double, float>;
TYPED_TEST_SUITE(PosegraphData, Scalars);

TYPED_TEST(PosegraphData, ReachesThePublishedOptimum) {
  using Graph = slam::PoseGraph<TypeParam, 4096, 8192, 32768>;
  for (const Known& known : kKnown) {
    const std::string path = test::posegraph_path(known.file);
    if (path.empty()) GTEST_SKIP() << known.file << " is not in $TETAP_DATA/posegraph";
    const auto file = test::read_g2o(path);
    const auto graph = std::make_unique<Graph>(slam::GraphOptions{.robust = false});
    fill(*graph, file);
    const auto before = std::chrono::steady_clock::now();
    run(*graph);
    const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - before;
    const double chi2 = chi2_of(file, track_of(*graph));
    std::printf("%s, %zu bits: chi2 %.7f, %d iterations, %.1f ms\n", known.file, 8 * sizeof(TypeParam), chi2,
                graph->iterations(), took.count());
    EXPECT_EQ(graph->status(), slam::GraphStatus::kConverged) << known.file;
    EXPECT_NEAR(chi2, known.chi2, 1e-6 * known.chi2) << known.file;
    EXPECT_NEAR(static_cast<double>(graph->chi2()), known.chi2, 3e-6 * known.chi2) << known.file;
  }
}

TEST(PosegraphRobust, FalseClosuresAreLeftOutAndTrueOnesAreNot) {
  using Graph = slam::PoseGraph<double, 2048, 4096, 32768>;
  for (const Known& known : {kKnown[0], kKnown[1]}) {
    const std::string path = test::posegraph_path(known.file);
    if (path.empty()) GTEST_SKIP() << known.file << " is not in $TETAP_DATA/posegraph";
    const auto file = test::read_g2o(path);
    const auto graph = std::make_unique<Graph>();
    fill(*graph, file, test::false_closures(file, 100, 1));
    run(*graph);
    EXPECT_EQ(graph->status(), slam::GraphStatus::kConverged) << known.file;
    // One that joins the poses of a true closure is lost to it at once.
    EXPECT_EQ(static_cast<unsigned>(graph->left_out()) + graph->lost(), 100U) << known.file;
    EXPECT_NEAR(chi2_of(file, track_of(*graph)), known.chi2, 1e-5 * known.chi2) << known.file;
  }
}

TEST(PosegraphRobust, WithoutFalseClosuresTheRobustOptimumIsThePlainOne) {
  using Graph = slam::PoseGraph<double, 2048, 4096, 32768>;
  for (const Known& known : {kKnown[0], kKnown[1], kKnown[2]}) {
    const std::string path = test::posegraph_path(known.file);
    if (path.empty()) GTEST_SKIP() << known.file << " is not in $TETAP_DATA/posegraph";
    const auto file = test::read_g2o(path);
    const auto graph = std::make_unique<Graph>();
    fill(*graph, file);
    run(*graph);
    EXPECT_EQ(graph->left_out(), 0) << known.file;
    EXPECT_NEAR(chi2_of(file, track_of(*graph)), known.chi2, 1e-6 * known.chi2) << known.file;
  }
}

}  // namespace
}  // namespace tetap
