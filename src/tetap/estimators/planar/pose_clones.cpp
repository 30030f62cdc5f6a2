// SPDX-License-Identifier: Apache-2.0
#include "tetap/estimators/planar/pose_clones.hpp"

#include "tetap/base/math.hpp"
#include "tetap/filter/inverse.hpp"
#include "tetap/slam/graph_edge.hpp"

namespace tetap::estimators {

namespace {

constexpr float kFreeSigma_m = 1e3F;

/// Inverse of the lower triangular factor of the covariance, by rows. A free axis has no correlations.
bool whitening(const sensor::RelativePose& z, std::array<float, 6>& w) {
  std::array<float, 3> s{};
  for (std::size_t i = 0; i < 3; ++i) s[i] = z.unknown(i) ? kFreeSigma_m : z.sigma_of(i);
  const auto product = [&](std::size_t a, std::size_t b, std::size_t pair) {
    return z.unknown(a) || z.unknown(b) ? 0.0F : z.correlation_of(pair) * s[a] * s[b];
  };
  PoseClones::Covariance r = PoseClones::Covariance::diagonal({s[0] * s[0], s[1] * s[1], s[2] * s[2]});
  r(0, 1) = product(0, 1, 0);
  r(0, 2) = product(0, 2, 1);
  r(1, 2) = product(1, 2, 2);
  return slam::whitening_of(r, w);
}

}  // namespace

void PoseClones::add(base::Micros stamp, const model::PlanarPose& x, const Covariance& p, int but) {
  const int k = but == 0 || (but == kNone && held(0) && stamp_[0] > stamp_[1]) ? 1 : 0, other = 1 - k;
  x_[at(k)] = x;
  stamp_[at(k)] = stamp;
  for (int c = 0; c < 3; ++c)
    for (int r = 0; r < 3; ++r) {
      cross(r, 3 * k + c) = p(r, c);
      if (r <= c) p_(3 * k + r, 3 * k + c) = p(r, c);
      p_(3 * k + r, 3 * other + c) = cross(r, 3 * other + c);
    }
}

void PoseClones::move(const model::PlanarPose& from, const model::PlanarPose& to) {
  const float dx_m = to.x.minus(from.x), dy_m = to.y.minus(from.y);
  for (int c = 0; c < 3 * kClones; ++c) {
    cross(0, c) -= dy_m * cross(2, c);
    cross(1, c) += dx_m * cross(2, c);
  }
}

void PoseClones::correct(const model::PlanarPose& x, const Covariance& p, const model::PlanarPose& new_x,
                         const Covariance& new_p) {
  if (!any()) return;
  const auto inverse = filter::inverse_of(p);
  if (!inverse.positive) return forget();
  const filter::Vector<float, 3> dx = new_x.minus(x);
  filter::Matrix<float, 3 * kClones, 3> gain;  // of the clones on the pose
  for (int c = 0; c < 3 * kClones; ++c)
    for (int r = 0; r < 3; ++r) {
      float sum = 0;
      for (int k = 0; k < 3; ++k) sum += cross(k, c) * inverse.value(k, r);
      gain(c, r) = sum;
    }
  for (int k = 0; k < kClones; ++k) {
    filter::Vector<float, 3> step;
    for (int r = 0; r < 3; ++r)
      step(r) = gain(3 * k + r, 0) * dx(0) + gain(3 * k + r, 1) * dx(1) + gain(3 * k + r, 2) * dx(2);
    if (held(k)) x_[at(k)] = x_[at(k)].plus(step);
  }
  filter::Matrix<float, 3 * kClones, 3> lost;  // gain (P - P+)
  for (int c = 0; c < 3 * kClones; ++c)
    for (int r = 0; r < 3; ++r) {
      float sum = 0, next = 0;
      for (int k = 0; k < 3; ++k) {
        sum += gain(c, k) * (p(k, r) - new_p(k, r));
        next += gain(c, k) * new_p(k, r);
      }
      lost(c, r) = sum;
      cross(r, c) = next;
    }
  for (int c = 0; c < 3 * kClones; ++c)
    for (int r = 0; r <= c; ++r)
      for (int k = 0; k < 3; ++k) p_(r, c) -= lost(r, k) * gain(c, k);
}

filter::Innovation<float, 3> PoseClones::update(const sensor::RelativePose& z, int from, model::PlanarPose& x,
                                                Covariance& p, float gate_scale) {
  filter::Innovation<float, 3> refused;
  std::array<float, 6> w{};
  if (!whitening(z, w)) return refused;
  const model::PlanarPose& c = x_[at(from)];
  const base::SinCos turn = base::sincos(c.yaw_rad);
  const float east_m = x.x.minus(c.x), north_m = x.y.minus(c.y);
  const float dx_m = turn.cos * east_m + turn.sin * north_m, dy_m = turn.cos * north_m - turn.sin * east_m;
  const std::array<float, 3> off{z.x_m - dx_m, z.y_m - dy_m,
                                 base::wrap_angle(z.yaw_rad - base::wrap_angle(x.yaw_rad - c.yaw_rad))};
  // Rows: the displacement by the pose of now and by the clone.
  const std::array<std::array<float, 6>, 3> h{{{turn.cos, turn.sin, 0, -turn.cos, -turn.sin, dy_m},
                                               {-turn.sin, turn.cos, 0, turn.sin, -turn.cos, -dx_m},
                                               {0, 0, 1, 0, 0, -1}}};
  filter::Matrix<float, 3, 6> white;
  filter::Vector<float, 3> nu, noise;
  for (int r = 0; r < 3; ++r) {
    const std::size_t row = at(r * (r + 1) / 2);
    const auto whitened = [&](auto&& value) {
      float sum = 0;
      for (int k = 0; k <= r; ++k) sum += w[row + at(k)] * value(at(k));
      return sum;
    };
    nu(r) = whitened([&](std::size_t k) { return off[k]; });
    for (int col = 0; col < 6; ++col) white(r, col) = whitened([&](std::size_t k) { return h[k][at(col)]; });
    noise(r) = 1.0F;
  }
  filter::Symmetric<float, kAll> all;
  for (int col = 0; col < 3; ++col)
    for (int r = 0; r <= col; ++r) all(r, col) = p(r, col);
  for (int col = 0; col < 3 * kClones; ++col) {
    for (int r = 0; r < 3; ++r) all(r, 3 + col) = held(col / 3) ? cross(r, col) : 0.0F;
    for (int r = 0; r <= col; ++r) all(3 + r, 3 + col) = held(col / 3) && held(r / 3) ? p_(r, col) : 0.0F;
  }
  const int axes = 3 - (z.unknown(0) ? 1 : 0) - (z.unknown(1) ? 1 : 0);
  const int first = 3 + 3 * from;
  const auto result = filter::update<float, kAll, 3, 6>(all, white, {0, 1, 2, first, first + 1, first + 2}, nu, noise,
                                                        gate_scale * filter::chi_square_99(axes));
  if (result.innovation.verdict != filter::Verdict::kAccepted) return result.innovation;
  x = x.plus(result.dx.head<3>());
  for (int k = 0; k < kClones; ++k)
    if (held(k)) x_[at(k)] = x_[at(k)].plus(result.dx.segment<3>(3 + 3 * k));
  for (int col = 0; col < 3; ++col)
    for (int r = 0; r <= col; ++r) p(r, col) = all(r, col);
  for (int col = 0; col < 3 * kClones; ++col) {
    for (int r = 0; r < 3; ++r) cross(r, col) = all(r, 3 + col);
    for (int r = 0; r <= col; ++r) p_(r, col) = all(3 + r, 3 + col);
  }
  return result.innovation;
}

}  // namespace tetap::estimators
