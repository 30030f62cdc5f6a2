// SPDX-License-Identifier: Apache-2.0
// The same pose graph by Ceres: sparse normal Cholesky on one thread, Jacobians in closed form. The trust region never
// binds, so that its steps are Gauss-Newton's. The trust radius of its default costs five times as long.
#include <ceres/ceres.h>

#include "bench/contestant.hpp"
#include "slam/g2o.hpp"

namespace tetap::bench {
namespace {

/// e = (R_z^T (R_a^T (b - a) - z), wrapped yaw_b - yaw_a - yaw_z), whitened; g2o's error.
class Displacement final : public ceres::SizedCostFunction<3, 3, 3> {
 public:
  explicit Displacement(const test::G2oEdge& edge)
      : z_(edge.z), turn_(test::rotation(-edge.z(2))), root_(edge.information.llt().matrixU()) {}
  bool Evaluate(double const* const* poses, double* residuals, double** jacobians) const override {
    const Eigen::Map<const Eigen::Vector3d> a(poses[0]), b(poses[1]);
    const double c = std::cos(a(2)), s = std::sin(a(2));
    const Eigen::Vector2d d = (b - a).head<2>();
    const Eigen::Vector2d seen(c * d(0) + s * d(1), -s * d(0) + c * d(1));
    Eigen::Vector3d e;
    e.head<2>() = turn_ * (seen - z_.head<2>());
    e(2) = std::remainder(b(2) - a(2) - z_(2), 2 * M_PI);
    Eigen::Map<Eigen::Vector3d>(residuals).noalias() = root_ * e;
    if (jacobians == nullptr) return true;
    Eigen::Matrix2d back;
    back << c, s, -s, c;
    const Eigen::Matrix2d of_b = turn_ * back;
    using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
    Eigen::Matrix3d j = Eigen::Matrix3d::Zero();
    if (jacobians[0] != nullptr) {
      j.topLeftCorner<2, 2>() = -of_b;
      j.topRightCorner<2, 1>() = turn_ * Eigen::Vector2d(seen(1), -seen(0));
      j(2, 2) = -1;
      Eigen::Map<RowMajor> of_first(jacobians[0]);
      of_first.noalias() = root_ * j;
    }
    if (jacobians[1] != nullptr) {
      j.setZero();
      j.topLeftCorner<2, 2>() = of_b;
      j(2, 2) = 1;
      Eigen::Map<RowMajor> of_second(jacobians[1]);
      of_second.noalias() = root_ * j;
    }
    return true;
  }

 private:
  Eigen::Vector3d z_;
  Eigen::Matrix2d turn_;
  Eigen::Matrix3d root_;
};

class Graph final : public GraphSolver {
 public:
  explicit Graph(const std::string& g2o) {
    const test::G2oGraph file = test::read_g2o(g2o);
    start_.resize(static_cast<std::size_t>(file.poses), {0, 0, 0});
    for (int i = 1; i < file.poses; ++i)
      for (const test::G2oEdge& edge : file.edges) {
        if (edge.from != i - 1 || edge.to != i) continue;
        const auto& from = start_[static_cast<std::size_t>(i - 1)];
        const Eigen::Vector2d step = test::rotation(from[2]) * edge.z.head<2>();
        start_[static_cast<std::size_t>(i)] = {from[0] + step(0), from[1] + step(1), from[2] + edge.z(2)};
      }
    poses_ = start_;
    for (const test::G2oEdge& edge : file.edges)
      problem_.AddResidualBlock(new Displacement(edge), nullptr, poses_[static_cast<std::size_t>(edge.from)].data(),
                                poses_[static_cast<std::size_t>(edge.to)].data());
    problem_.SetParameterBlockConstant(poses_[0].data());
    options_.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
    options_.initial_trust_region_radius = 1e16;
    options_.num_threads = 1;
    options_.logging_type = ceres::SILENT;
  }
  void reset() override { std::copy(start_.begin(), start_.end(), poses_.begin()); }
  void solve() override {
    ceres::Solver::Summary summary;
    ceres::Solve(options_, &problem_, &summary);
    if (summary.termination_type != ceres::CONVERGENCE) throw std::runtime_error(summary.BriefReport());
  }
  [[nodiscard]] std::vector<std::array<double, 3>> track() const override { return poses_; }

 private:
  std::vector<std::array<double, 3>> start_, poses_;
  ceres::Problem problem_;
  ceres::Solver::Options options_;
};

}  // namespace

std::unique_ptr<GraphSolver> ceres_graph(const std::string& g2o) { return std::make_unique<Graph>(g2o); }

}  // namespace tetap::bench
