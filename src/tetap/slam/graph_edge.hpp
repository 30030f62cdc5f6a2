// SPDX-License-Identifier: Apache-2.0
// A measured displacement between two poses of a graph: residual, whitening, linearisation and weight. The weight is
// that of dynamic covariance scaling (Agarwal, Tipaldi, Spinello, Stachniss, Burgard, ICRA 2013, eq. 15-16). Error and
// Jacobians: Grisetti, Kuemmerle, Stachniss, Burgard, IEEE ITS Magazine 2(4), 2010, sec. III-B.
#pragma once

#include "tetap/slam/planar_motion.hpp"
#include "tetap/slam/square_root.hpp"

#include <array>
#include <cstdint>

namespace tetap::slam {

/// Implements docs/explanation/pose_graph.md (2).
/// The inverse of the lower triangular factor L of a covariance L L^T, by rows. False, and nothing is set, when the
/// covariance is not positive definite in this arithmetic, or no number.
template <class Scalar>
[[nodiscard]] bool whitening_of(const filter::Symmetric<Scalar, 3>& c, std::array<Scalar, 6>& w) {
  constexpr auto kLeast = static_cast<Scalar>(1e-18),
                 kMost = static_cast<Scalar>(1e12);  // variances whose square root can be whitened in float
  const Scalar l00 = base::sqrt(c(0, 0));
  if (!(c(0, 0) > kLeast && c(0, 0) < kMost)) return false;
  const Scalar l10 = c(0, 1) / l00, l20 = c(0, 2) / l00;
  const Scalar d1 = c(1, 1) - l10 * l10;
  if (!(d1 > kLeast && d1 < kMost)) return false;
  const Scalar l11 = base::sqrt(d1), l21 = (c(1, 2) - l20 * l10) / l11;
  const Scalar d2 = c(2, 2) - l20 * l20 - l21 * l21;
  if (!(d2 > kLeast && d2 < kMost)) return false;
  const Scalar w0 = Scalar{1} / l00, w2 = Scalar{1} / l11, w5 = Scalar{1} / base::sqrt(d2);
  const Scalar w1 = -l10 * w0 * w2;
  w = {w0, w1, w2, -(l20 * w0 + l21 * w1) * w5, -l21 * w2 * w5, w5};
  return true;
}

/// W^T W of a lower triangular W by rows.
template <class Scalar>
[[nodiscard]] filter::Symmetric<Scalar, 3> square_of(const std::array<Scalar, 6>& w) {
  filter::Symmetric<Scalar, 3> s;
  s(0, 0) = w[0] * w[0] + w[1] * w[1] + w[3] * w[3];
  s(0, 1) = w[1] * w[2] + w[3] * w[4];
  s(1, 1) = w[2] * w[2] + w[4] * w[4];
  s(0, 2) = w[3] * w[5];
  s(1, 2) = w[4] * w[5];
  s(2, 2) = w[5] * w[5];
  return s;
}

/// The inverse of a covariance by the same factor. False, and nothing is set, where there is none.
template <class Scalar>
[[nodiscard]] bool inverse_of(const filter::Symmetric<Scalar, 3>& c, filter::Symmetric<Scalar, 3>& inverse) {
  std::array<Scalar, 6> w{};
  if (!whitening_of(c, w)) return false;
  inverse = square_of(w);
  return true;
}

template <class Scalar>
struct GraphEdge {
  std::uint32_t from : 14;
  std::uint32_t to : 14;
  std::uint32_t closure : 1;   ///< may be false, so it is weighted; 0: odometry
  std::uint32_t off : 1;       ///< taken for false by the job at hand
  std::uint32_t left_out : 1;  ///< taken for false by the job that gave the poses
  std::uint32_t refused : 1;   ///< counts for nothing until a trial shows that it fits
  Displacement<Scalar> z;
  std::array<Scalar, 6> whitening;  ///< lower triangle, by rows

  using Residual = std::array<Scalar, 3>;

  [[nodiscard]] Residual whiten(Scalar x, Scalar y, Scalar yaw) const {
    const auto& w = whitening;
    return {w[0] * x, w[1] * x + w[2] * y, w[3] * x + w[4] * y + w[5] * yaw};
  }
  /// Implements docs/explanation/pose_graph.md (1).
  [[nodiscard]] Residual residual(const GraphPose<Scalar>& a, const GraphPose<Scalar>& b) const {
    const Displacement<Scalar> d = b.minus(a);
    return whiten(d.x_m - z.x_m, d.y_m - z.y_m, (d.yaw - z.yaw).radians());
  }
  [[nodiscard]] Scalar chi2(const GraphPose<Scalar>& a, const GraphPose<Scalar>& b) const {
    const Residual r = residual(a, b);
    return r[0] * r[0] + r[1] * r[1] + r[2] * r[2];
  }

  /// The covariance that the whitening was made of.
  [[nodiscard]] filter::Symmetric<Scalar, 3> covariance() const {
    const auto& w = whitening;  // L is the inverse of the lower triangle
    const Scalar l0 = Scalar{1} / w[0], l2 = Scalar{1} / w[2], l5 = Scalar{1} / w[5];
    const Scalar l1 = -w[1] * l0 * l2, l4 = -w[4] * l2 * l5, l3 = -(w[3] * l0 + w[4] * l1) * l5;
    filter::Symmetric<Scalar, 3> c;
    c(0, 0) = l0 * l0;
    c(0, 1) = l0 * l1;
    c(1, 1) = l1 * l1 + l2 * l2;
    c(0, 2) = l0 * l3;
    c(1, 2) = l1 * l3 + l2 * l4;
    c(2, 2) = l3 * l3 + l4 * l4 + l5 * l5;
    return c;
  }

  /// Whitened Jacobians by the two poses' (x, y, yaw) and the whitened residual, negative; its sum of squares.
  Scalar linearise(const GraphPose<Scalar>& a, const GraphPose<Scalar>& b, BlockRow<Scalar>& row) const {
    const auto turn = a.yaw.direction();
    const Scalar c = turn.cos, s = turn.sin;
    const Scalar dx = b.x.minus(a.x), dy = b.y.minus(a.y);
    const Scalar x = c * dx + s * dy, y = c * dy - s * dx;
    const Residual r = whiten(x - z.x_m, y - z.y_m, (b.yaw - a.yaw - z.yaw).radians());
    const Residual by_x = whiten(c, -s, Scalar{0}), by_y = whiten(s, c, Scalar{0});
    const Residual by_yaw_b = whiten(Scalar{0}, Scalar{0}, Scalar{1}), by_yaw_a = whiten(y, -x, Scalar{-1});
    for (std::size_t i = 0; i < 3; ++i) {
      row.of_first[i] = {-by_x[i], -by_y[i], by_yaw_a[i]};
      row.of_second[i] = {by_x[i], by_y[i], by_yaw_b[i]};
      row.rest[i] = -r[i];
    }
    return r[0] * r[0] + r[1] * r[1] + r[2] * r[2];
  }
};

/// Two measurements of the same displacement as one (information filter). Nothing when they contradict each other: the
/// squared difference, by both covariances, is above the gate.
template <class Scalar>
[[nodiscard]] bool merge(GraphEdge<Scalar>& into, const GraphEdge<Scalar>& other, Scalar gate) {
  filter::Symmetric<Scalar, 3> both = into.covariance();
  const filter::Symmetric<Scalar, 3> c = both, more = other.covariance();
  for (int k = 0; k < 3; ++k)
    for (int r = 0; r <= k; ++r) both(r, k) += more(r, k);
  GraphEdge<Scalar> sum = into;
  if (!whitening_of(both, sum.whitening)) return false;
  const auto nu = sum.whiten(other.z.x_m - into.z.x_m, other.z.y_m - into.z.y_m, (other.z.yaw - into.z.yaw).radians());
  if (!(nu[0] * nu[0] + nu[1] * nu[1] + nu[2] * nu[2] <= gate)) return false;
  std::array<typename GraphEdge<Scalar>::Residual, 3> gain;  // row n: C e_n, whitened by the sum
  for (int n = 0; n < 3; ++n) gain[static_cast<std::size_t>(n)] = sum.whiten(c(n, 0), c(n, 1), c(n, 2));
  filter::Symmetric<Scalar, 3> fused = c;
  std::array<Scalar, 3> dx{};
  for (std::size_t k = 0; k < 3; ++k) {
    for (std::size_t m = 0; m < 3; ++m) dx[k] += gain[k][m] * nu[m];
    for (std::size_t r = 0; r <= k; ++r)
      for (std::size_t m = 0; m < 3; ++m) fused(static_cast<int>(r), static_cast<int>(k)) -= gain[r][m] * gain[k][m];
  }
  if (!whitening_of(fused, into.whitening)) return false;
  into.z = {into.z.x_m + dx[0], into.z.y_m + dx[1], into.z.yaw + Heading<Scalar>::from_radians(dx[2])};
  return true;
}

/// Implements docs/explanation/pose_graph.md (5).
/// Scale of residual and Jacobian, in (0, 1], for a squared error chi2 and the free parameter phi.
template <class Scalar>
[[nodiscard]] constexpr Scalar dynamic_scale(Scalar chi2, Scalar phi) {
  const Scalar scale = Scalar{2} * phi / (phi + chi2);
  return scale < Scalar{1} ? scale : Scalar{1};
}

}  // namespace tetap::slam
