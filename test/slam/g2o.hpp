// SPDX-License-Identifier: Apache-2.0
// Reader of planar pose graphs in text, for tests and host tools. Formats: g2o's VERTEX_SE2 / EDGE_SE2 (Kuemmerle,
// Grisetti, Strasdat, Konolige, Burgard, ICRA 2011). TORO's VERTEX2 / EDGE2 with its own order of the information
// (Grisetti, Stachniss, Grzonka, Burgard, RSS 2007). Errors name the line and the cause.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <istream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace tetap::test {

struct G2oEdge {
  int from = 0, to = 0;
  Eigen::Vector3d z;  ///< x, y [m], yaw [rad] of `to` in the frame of `from`
  Eigen::Matrix3d information;
};

struct G2oGraph {
  int poses = 0;
  std::vector<G2oEdge> edges;
};

class G2oError : public std::runtime_error {
 public:
  G2oError(int line, const std::string& cause) : std::runtime_error("line " + std::to_string(line) + ": " + cause) {}
};

inline G2oEdge g2o_edge(std::istringstream& in, bool toro, int line) {
  G2oEdge edge;
  double i[6];
  in >> edge.from >> edge.to >> edge.z(0) >> edge.z(1) >> edge.z(2);
  for (double& value : i) in >> value;
  if (!in) throw G2oError(line, "an edge needs two ids, three numbers of displacement and six of information");
  std::string rest;
  if (in >> rest) throw G2oError(line, "more than eleven numbers: " + rest);
  if (edge.from < 0 || edge.to < 0) throw G2oError(line, "an id below zero");
  if (edge.from == edge.to) throw G2oError(line, "an edge from a pose to itself");
  if (toro)
    edge.information << i[0], i[1], i[4], i[1], i[2], i[5], i[4], i[5], i[3];  // 11 12 22 33 13 23
  else
    edge.information << i[0], i[1], i[2], i[1], i[3], i[4], i[2], i[4], i[5];  // 11 12 13 22 23 33
  if (!edge.z.allFinite() || !edge.information.allFinite()) throw G2oError(line, "a value that is no finite number");
  if (edge.information.llt().info() != Eigen::Success) throw G2oError(line, "information is not positive definite");
  return edge;
}

/// All of it, or a G2oError. Ids have to be 0 ... n - 1, with odometry from each to the next.
inline G2oGraph read_g2o(std::istream& in) {
  G2oGraph graph;
  std::string text;
  int line = 0, last = -1;
  for (; std::getline(in, text); ++line) {
    std::istringstream words(text);
    std::string tag;
    if (!(words >> tag) || tag[0] == '#' || tag == "FIX") continue;
    if (tag == "VERTEX_SE2" || tag == "VERTEX2") {
      int id = -1;
      double x = 0, y = 0, yaw = 0;
      if (!(words >> id >> x >> y >> yaw)) throw G2oError(line + 1, "a vertex needs an id and three numbers");
      last = std::max(last, id);
    } else if (tag == "EDGE_SE2" || tag == "EDGE2") {
      graph.edges.push_back(g2o_edge(words, tag == "EDGE2", line + 1));
      last = std::max({last, graph.edges.back().from, graph.edges.back().to});
    } else {
      throw G2oError(line + 1, "neither a planar vertex nor a planar edge: " + tag);
    }
  }
  graph.poses = last + 1;
  std::vector<bool> reached(static_cast<std::size_t>(graph.poses) + 1, false);
  for (const G2oEdge& edge : graph.edges)
    if (std::abs(edge.from - edge.to) == 1) reached[static_cast<std::size_t>(std::max(edge.from, edge.to))] = true;
  for (int i = 1; i < graph.poses; ++i)
    if (!reached[static_cast<std::size_t>(i)])
      throw G2oError(line, "no odometry leads from pose " + std::to_string(i - 1) + " to " + std::to_string(i));
  return graph;
}

inline G2oGraph read_g2o(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw std::runtime_error(path + ": cannot be opened");
  return read_g2o(file);
}

/// A matrix: a product with Eigen's own rotation keeps a reference to a temporary.
[[nodiscard]] inline Eigen::Matrix2d rotation(double rad) { return Eigen::Rotation2Dd(rad).toRotationMatrix(); }

/// e^T information e of an edge at two poses (x, y, yaw), with g2o's error: the translation turned by R_z^T.
inline double g2o_chi2(const G2oEdge& edge, const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  const Eigen::Vector2d d = rotation(-a(2)) * (b - a).head<2>() - edge.z.head<2>();
  const Eigen::Vector2d t = rotation(-edge.z(2)) * d;
  const Eigen::Vector3d e(t(0), t(1), std::remainder(b(2) - a(2) - edge.z(2), 2 * M_PI));
  return e.dot(edge.information * e);
}

/// Covariance of the displacement in the frame of `from`.
inline Eigen::Matrix3d g2o_covariance(const G2oEdge& edge) {
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  turn.topLeftCorner<2, 2>() = Eigen::Rotation2Dd(edge.z(2)).toRotationMatrix();
  return turn * edge.information.inverse() * turn.transpose();
}

}  // namespace tetap::test
