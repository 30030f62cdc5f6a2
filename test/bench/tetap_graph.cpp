// SPDX-License-Identifier: Apache-2.0
// tetap's pose graph in double, without the robust kernel, which Ceres does not have here either.
#include "bench/contestant.hpp"
#include "slam/graphs.hpp"
#include "tetap/slam/pose_graph.hpp"

namespace tetap::bench {
namespace {

class Graph final : public GraphSolver {
 public:
  explicit Graph(const std::string& g2o) {
    const test::G2oGraph file = test::read_g2o(g2o);
    for (int i = 1; i < file.poses; ++i)
      for (const test::G2oEdge& edge : file.edges)
        if (edge.from == i - 1 && edge.to == i) require(loaded_->append(test::motion_of<double>(edge)));
    for (const test::G2oEdge& edge : file.edges)
      if (edge.to != edge.from + 1) require(loaded_->close(edge.from, edge.to, test::motion_of<double>(edge)));
  }
  void reset() override { *graph_ = *loaded_; }
  void solve() override {
    require(graph_->begin());
    while (graph_->busy()) graph_->work(1'000'000'000);
    require(graph_->status() == slam::GraphStatus::kConverged);
  }
  [[nodiscard]] std::vector<std::array<double, 3>> track() const override {
    std::vector<std::array<double, 3>> track;
    for (int i = 0; i < graph_->poses(); ++i) {
      const Eigen::Vector3d pose = test::vector_of(graph_->pose(i));
      track.push_back({pose(0), pose(1), pose(2)});
    }
    return track;
  }

 private:
  static void require(bool holds) {
    if (!holds) throw std::runtime_error("the graph refused an input or did not converge");
  }
  using Poses = slam::PoseGraph<double, 4096, 8192, 32768>;
  std::unique_ptr<Poses> loaded_ = std::make_unique<Poses>(slam::GraphOptions{.robust = false});
  std::unique_ptr<Poses> graph_ = std::make_unique<Poses>(slam::GraphOptions{.robust = false});
};

}  // namespace

std::unique_ptr<GraphSolver> tetap_graph(const std::string& g2o) { return std::make_unique<Graph>(g2o); }

}  // namespace tetap::bench
