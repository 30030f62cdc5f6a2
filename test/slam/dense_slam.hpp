// SPDX-License-Identifier: Apache-2.0
// EKF-SLAM as a textbook writes it, dense and in double: what the packed one is compared with. The standard form adds
// corrections; the invariant form moves each point along the exponential map and P with the points (Barrau & Bonnabel
// 2015).
#pragma once

#include <Eigen/Dense>
#include <cmath>
#include <map>

namespace tetap::test {

enum class SlamForm { kStandard, kInvariant };

struct DenseSlam {
  SlamForm form;
  Eigen::VectorXd x;
  Eigen::MatrixXd p;
  std::map<int, int> state_of;  ///< first state of a landmark
  double sigma_range_m = 0.1, sigma_bearing_rad = 0.02;

  DenseSlam(SlamForm f, const Eigen::Vector3d& pose, const Eigen::Vector3d& sigma)
      : form(f), x(pose), p(sigma.cwiseProduct(sigma).asDiagonal()) {}

  void predict(double ds_m, double dyaw_rad, double var_ds, double var_dyaw) {
    const double h = x(2) + dyaw_rad / 2, chord = std::abs(dyaw_rad) < 1e-9 ? 1 : std::sin(dyaw_rad / 2) / dyaw_rad * 2;
    const double ds = ds_m * chord;
    Eigen::Matrix3d f = Eigen::Matrix3d::Identity();
    f(0, 2) = -ds * std::sin(h), f(1, 2) = ds * std::cos(h);
    Eigen::Matrix<double, 3, 2> g;
    g << std::cos(h), -ds / 2 * std::sin(h), std::sin(h), ds / 2 * std::cos(h), 0, 1;
    p.topRows(3) = (f * p.topRows(3)).eval();
    p.leftCols(3) = (p.leftCols(3) * f.transpose()).eval();
    p.topLeftCorner(3, 3) += g * Eigen::Vector2d(var_ds, var_dyaw).asDiagonal() * g.transpose();
    x(0) += ds * std::cos(h), x(1) += ds * std::sin(h), x(2) += dyaw_rad;
  }
  void add(int id, double range_m, double bearing_rad) {
    const auto n = x.size();
    const double a = x(2) + bearing_rad, c = std::cos(a), s = std::sin(a);
    Eigen::Matrix<double, 2, 3> of_pose;
    of_pose << 1, 0, -range_m * s, 0, 1, range_m * c;
    Eigen::Matrix2d of_z;
    of_z << c, -range_m * s, s, range_m * c;
    Eigen::MatrixXd grown = Eigen::MatrixXd::Zero(n + 2, n + 2);
    grown.topLeftCorner(n, n) = p;
    grown.bottomLeftCorner(2, n) = of_pose * p.topRows(3);
    grown.topRightCorner(n, 2) = grown.bottomLeftCorner(2, n).transpose();
    grown.bottomRightCorner(2, 2) =
        of_pose * p.topLeftCorner(3, 3) * of_pose.transpose() + of_z * noise() * of_z.transpose();
    p = grown;
    x.conservativeResize(n + 2);
    x(n) = x(0) + range_m * c, x(n + 1) = x(1) + range_m * s;
    state_of[id] = static_cast<int>(n);
  }
  /// The NIS of the sighting.
  double update(int id, double range_m, double bearing_rad) {
    const int o = state_of.at(id);
    const double dx = x(o) - x(0), dy = x(o + 1) - x(1), q = dx * dx + dy * dy, r = std::sqrt(q);
    Eigen::MatrixXd h = Eigen::MatrixXd::Zero(2, x.size());
    h.block<2, 3>(0, 0) << -dx / r, -dy / r, 0, dy / q, -dx / q, -1;
    h.block<2, 2>(0, o) << dx / r, dy / r, -dy / q, dx / q;
    const Eigen::Vector2d nu(range_m - r, std::remainder(bearing_rad - std::atan2(dy, dx) + x(2), 2 * M_PI));
    const Eigen::Matrix2d s = h * p * h.transpose() + noise();
    const Eigen::MatrixXd gain = p * h.transpose() * s.inverse();
    const Eigen::VectorXd correction = gain * nu;
    p -= gain * s * gain.transpose();
    form == SlamForm::kStandard ? static_cast<void>(x += correction) : move(correction);
    return nu.dot(s.inverse() * nu);
  }
  [[nodiscard]] Eigen::Matrix2d noise() const {
    return Eigen::Vector2d(sigma_range_m * sigma_range_m, sigma_bearing_rad * sigma_bearing_rad).asDiagonal();
  }

 private:
  /// Along the exponential map of SE(2), with the covariance in the coordinates of the new points.
  void move(const Eigen::VectorXd& d) {
    const double t = d(2), sinc = std::abs(t) < 1e-9 ? 1 : std::sin(t) / t,
                 cosc = std::abs(t) < 1e-9 ? t / 2 : (1 - std::cos(t)) / t;
    Eigen::VectorXd to = x;
    Eigen::MatrixXd transport = Eigen::MatrixXd::Identity(x.size(), x.size());
    const auto point = [&](Eigen::Index i) {
      // xi = d - J x t, the invariant correction; the point turns about the origin and moves by V xi.
      const double ix = d(i) + x(i + 1) * t, iy = d(i + 1) - x(i) * t;
      to(i) = std::cos(t) * x(i) - std::sin(t) * x(i + 1) + sinc * ix - cosc * iy;
      to(i + 1) = std::sin(t) * x(i) + std::cos(t) * x(i + 1) + cosc * ix + sinc * iy;
      transport(i, 2) = -(to(i + 1) - x(i + 1));
      transport(i + 1, 2) = to(i) - x(i);
    };
    point(0);
    for (Eigen::Index i = 3; i < x.size(); i += 2) point(i);
    to(2) = x(2) + t;
    x = to;
    p = (transport * p * transport.transpose()).eval();
  }
};

}  // namespace tetap::test
