// SPDX-License-Identifier: Apache-2.0
// Parts that the tests of graphs share: edges of a file as inputs of a graph, and the judges' figures, in double.
#pragma once

#include "slam/g2o.hpp"
#include "tetap/slam/planar_motion.hpp"

#include <cstdlib>
#include <filesystem>
#include <random>

namespace tetap::test {

/// A file of $TETAP_DATA/posegraph, or nothing.
inline std::string posegraph_path(const std::string& name) {
  const char* const data = std::getenv("TETAP_DATA");
  const std::filesystem::path root = data != nullptr ? data : "../shared/data";
  for (const auto& base : {root, std::filesystem::path("..") / root, std::filesystem::path("../..") / root})
    if (std::filesystem::exists(base / "posegraph" / name)) return (base / "posegraph" / name).string();
  return {};
}

template <class Scalar>
slam::UncertainDisplacement<Scalar> motion_of(const G2oEdge& edge) {
  const Eigen::Matrix3d covariance = g2o_covariance(edge);
  slam::UncertainDisplacement<Scalar> motion;
  motion.mean = {static_cast<Scalar>(edge.z(0)), static_cast<Scalar>(edge.z(1)),
                 slam::Heading<Scalar>::from_radians(static_cast<Scalar>(edge.z(2)))};
  for (int c = 0; c < 3; ++c)
    for (int r = 0; r <= c; ++r) motion.covariance(r, c) = static_cast<Scalar>(covariance(r, c));
  return motion;
}

template <class Pose>
Eigen::Vector3d vector_of(const Pose& pose) {
  const double turn = 2 * M_PI / std::pow(2.0, 8.0 * sizeof(pose.yaw.turn));
  return {pose.x.unit / 1024.0 + static_cast<double>(pose.x.rest_m),
          pose.y.unit / 1024.0 + static_cast<double>(pose.y.rest_m), static_cast<double>(pose.yaw.turn) * turn};
}

/// Root mean square distance of two tracks after the best rigid motion of the first (Horn 1987).
inline double aligned_rmse(const std::vector<Eigen::Vector3d>& a, const std::vector<Eigen::Vector3d>& b) {
  Eigen::Vector2d of_a = Eigen::Vector2d::Zero(), of_b = Eigen::Vector2d::Zero();
  for (std::size_t i = 0; i < a.size(); ++i) of_a += a[i].head<2>(), of_b += b[i].head<2>();
  of_a /= static_cast<double>(a.size());
  of_b /= static_cast<double>(a.size());
  double c = 0, s = 0, sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const Eigen::Vector2d p = a[i].head<2>() - of_a, q = b[i].head<2>() - of_b;
    c += p.dot(q);
    s += p(0) * q(1) - p(1) * q(0);
  }
  const Eigen::Rotation2Dd turn(std::atan2(s, c));
  for (std::size_t i = 0; i < a.size(); ++i)
    sum += (turn * (a[i].head<2>() - of_a) - (b[i].head<2>() - of_b)).squaredNorm();
  return std::sqrt(sum / static_cast<double>(a.size()));
}

/// Closures between poses that have nothing to do with each other, as sharp as the graph's first true one.
inline std::vector<G2oEdge> false_closures(const G2oGraph& graph, int count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_int_distribution<int> any(0, graph.poses - 1);
  std::normal_distribution<double> normal;
  Eigen::Matrix3d information = Eigen::Matrix3d::Identity();
  for (const G2oEdge& edge : graph.edges)
    if (std::abs(edge.from - edge.to) != 1) {
      information = edge.information;
      break;
    }
  std::vector<G2oEdge> edges;
  while (static_cast<int>(edges.size()) < count) {
    const int a = any(random), b = any(random);
    if (std::abs(a - b) < 2) continue;
    const double x = normal(random), y = normal(random), yaw = 0.3 * normal(random);
    edges.push_back({std::min(a, b), std::max(a, b), {x, y, yaw}, information});
  }
  return edges;
}

}  // namespace tetap::test
