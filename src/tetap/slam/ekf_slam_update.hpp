// SPDX-License-Identifier: Apache-2.0
// The update of EKF-SLAM: gains of several sightings one after another, then one pass over P for all of them.
// Implements docs/explanation/ekf_slam.md (6) to (8).
#pragma once

#include "tetap/slam/ekf_slam.hpp"

namespace tetap::slam {

template <int kLandmarks_, int kBatch_>
void EkfSlam<kLandmarks_, kBatch_>::fuse_batch(std::span<const Sighting> seen, std::span<const Pair> pairs,
                                               std::int64_t stamp_us, std::span<SightingRecord> records) {
  int rank = 0;
  for (const Pair& pair : pairs) {
    const auto s = at(pair.sighting);
    SightingRecord& record = records[s];
    const SightLine line = this->line(seen[s], pair.landmark);
    p_.template times<2, 3, 2>(line.h, state_of(pair.landmark), w_, rank + 2);
    record = record_of(seen[s], pair.landmark, line,
                       [&](std::size_t r, int t) { return w_[at(touched(pair.landmark, t))][at(rank + 2) + r]; });
    const float repeated = path_.repetition(map_[pair.landmark].seen_path_um, options.correlation_m);
    if (record.verdict == SightingVerdict::kAccepted && !gain(line, pair.landmark, rank, record, repeated))
      record.verdict = SightingVerdict::kOutlier;
    switch (record.verdict) {
      case SightingVerdict::kAccepted:
        rank += 2;
        ++counts_.fused;
        map_.seen(pair.landmark, stamp_us, path_.um());
        break;
      case SightingVerdict::kOutlier:
        ++counts_.outliers;
        break;
      default:
        ++counts_.rejected;
    }
  }
  if (rank > 0) apply(rank);
}

/// Turns the two columns P H^T at `rank` into two of G, conditioned on the columns before them: (6). False when
/// the sighting contradicts those before it.
template <int kLandmarks_, int kBatch_>
bool EkfSlam<kLandmarks_, kBatch_>::gain(const SightLine& line, int k, int rank, const SightingRecord& record,
                                         float repeated) {
  std::array<std::array<float, 2>, static_cast<std::size_t>(kRank)> hg{};
  std::array<float, 2> nu = line.nu;
  Covariance2 s = record.s;
  s.xx += (repeated - 1.0F) * line.r[0];
  s.yy += (repeated - 1.0F) * line.r[1];
  const auto state = at(state_of(k));
  for (int j = 0; j < rank; ++j) {
    const auto column = at(2 + j);
    const std::array<float, 5> g{w_[0][column], w_[1][column], w_[2][column], w_[state][column], w_[state + 1][column]};
    float a = 0.0F, b = 0.0F;
#pragma GCC unroll 5
    for (std::size_t t = 0; t < 5; ++t) {
      a += line.h[0][t] * g[t];
      b += line.h[1][t] * g[t];
    }
    hg[at(j)] = {a, b};
    nu[0] -= a * y_[at(j)];
    nu[1] -= b * y_[at(j)];
    s.xx -= a * a;
    s.xy -= a * b;
    s.yy -= b * b;
  }
  const Root2 root(s);
  if (!root.valid) return false;
  const auto y = root.solve(nu);
  if (!(y[0] * y[0] + y[1] * y[1] <= gate_of(record.components))) return false;
  with_rank<0, kBatch - 1>(rank, [&](auto before) { condition<before()>(hg, root); });
  y_[at(rank)] = y[0];
  y_[at(rank + 1)] = y[1];
  return true;
}

/// Rows of P H^T to rows of G, beside kBefore columns that are there.
template <int kLandmarks_, int kBatch_>
template <int kBefore>
void EkfSlam<kLandmarks_, kBatch_>::condition(const std::array<std::array<float, 2>, kRank>& rows, const Root2& root) {
  std::array<std::array<float, 2>, static_cast<std::size_t>(kBefore)>
      hg;  // a copy that no store to the scratch changes
  for (std::size_t j = 0; j < kBefore; ++j) hg[j] = rows[j];
  const float yx = root.yx, per_x = 1.0F / root.xx, per_y = 1.0F / root.yy;
  const int size = p_.size();
  for (int n = 0; n < size; ++n) {
    auto& row = w_[at(n)];
    float a = row[kBefore + 2], b = row[kBefore + 3];
#pragma GCC unroll 16
    for (std::size_t j = 0; j < kBefore; ++j) {
      a = base::subtract_product(a, row[2 + j], hg[j][0]);
      b = base::subtract_product(b, row[2 + j], hg[j][1]);
    }
    a *= per_x;
    row[kBefore + 2] = a;
    row[kBefore + 3] = (b - yx * a) * per_y;
  }
}

/// State (7) and covariance (8) after the gains.
template <int kLandmarks_, int kBatch_>
void EkfSlam<kLandmarks_, kBatch_>::apply(int rank) {
  float turn = 0.0F;
  for (int j = 0; j < rank; ++j) turn += w_[2][at(2 + j)] * y_[at(j)];
  // V(turn) of the exponential map: sin t / t and (1 - cos t) / t.
  const base::SinCos half = base::sincos(0.5F * turn);
  const bool small = base::abs(turn) < 1e-3F;
  const float v_c = small ? 1.0F - turn * turn * (1.0F / 6.0F) : 2.0F * half.sin * half.cos / turn;
  const float v_s = small ? 0.5F * turn : 2.0F * half.sin * half.sin / turn;
  with_rank<1, kBatch>(rank, [&](auto columns) { corrections<columns()>(); });
  const float half_variance = 0.5F * w_[2][1];
  const auto move = [&](int n, base::Anchored& x, base::Anchored& y) {
    auto &row_x = w_[at(n)], &row_y = w_[at(n + 1)];
    const float dx = v_c * row_x[0] - v_s * row_y[0], dy = v_s * row_x[0] + v_c * row_y[0];
    add_to(x, dx);
    add_to(y, dy);
    row_x[0] = -dy;
    row_y[0] = dx;
    row_x[1] += half_variance * -dy;
    row_y[1] += half_variance * dx;
  };
  move(0, pose_.x, pose_.y);
  for (int k = 0; k < map_.size(); ++k) move(state_of(k), map_[k].place.x, map_[k].place.y);
  pose_.yaw_rad = base::wrap_angle(pose_.yaw_rad + turn);
  w_[2][0] = 0.0F;
  with_rank<1, kBatch>(rank, [&](auto columns) { p_.template correct<columns()>(w_); });
  // As much as rounding may have taken: P stays positive definite however often a robot at rest sees the same.
  p_.inflate(kRounding);
}

/// Columns 0 and 1 of the scratch: dx, and the column of yaw after the gains.
template <int kLandmarks_, int kBatch_>
template <int kColumns>
void EkfSlam<kLandmarks_, kBatch_>::corrections() {
  std::array<float, kColumns> yaw, y;
  for (std::size_t j = 0; j < kColumns; ++j) yaw[j] = w_[2][2 + j], y[j] = y_[j];
  const int size = p_.size();
  for (int n = 0; n < size; ++n) {
    auto& row = w_[at(n)];
    float dx = 0.0F, with_yaw = p_(n, 2);
#pragma GCC unroll 16
    for (std::size_t j = 0; j < kColumns; ++j) {
      dx = base::add_product(dx, row[2 + j], y[j]);
      with_yaw = base::subtract_product(with_yaw, row[2 + j], yaw[j]);
    }
    row[0] = dx;
    row[1] = with_yaw;
  }
}

/// A place for one more landmark: an unconfirmed one gives way, any other only where the options want it.
template <int kLandmarks_, int kBatch_>
bool EkfSlam<kLandmarks_, kBatch_>::make_room() {
  if (!map_.full()) return true;
  const int below = options.when_full == WhenFull::kReplaceOldest ? 0x10000 : options.confirming_hits;
  const int oldest = map_.oldest(below);
  if (oldest == Map::kNone) {
    ++counts_.no_room;
    return false;
  }
  remove(oldest);
  return true;
}

/// Implements docs/explanation/ekf_slam.md (12).
template <int kLandmarks_, int kBatch_>
void EkfSlam<kLandmarks_, kBatch_>::set_pose(const model::PlanarPose& pose, const filter::Symmetric<float, 3>& p) {
  const base::SinCos turn = base::sincos(pose.yaw_rad - pose_.yaw_rad);
  std::array<typename Covariance::States, 3> lever{};  // of yaw, x, y on each landmark
  const auto shear_all = [&](float sign) {
    for (int k = 0; k < map_.size(); ++k) {
      const int s = state_of(k);
      lever[0][at(s)] = -sign * map_[k].place.y.minus(pose_.y);
      lever[0][at(s + 1)] = sign * map_[k].place.x.minus(pose_.x);
      lever[1][at(s)] = sign;
      lever[2][at(s + 1)] = sign;
    }
    p_.shear(2, lever[0]);
    p_.shear(0, lever[1]);
    p_.shear(1, lever[2]);
  };
  shear_all(-1.0F);  // errors of the landmarks beside the robot
  const model::PlanarPose from = pose_;
  for (int k = 0; k < map_.size(); ++k) {
    model::Landmark& place = map_[k].place;
    const float dx = place.x.minus(from.x), dy = place.y.minus(from.y);
    place.x = pose.x.plus(turn.cos * dx - turn.sin * dy);
    place.y = pose.y.plus(turn.sin * dx + turn.cos * dy);
  }
  p_.turn_pairs(3, turn.cos, turn.sin);
  for (int n = 0; n < p_.size(); ++n)
    for (int r = 0; r < 3; ++r) p_(r, n) = n < 3 ? p(r, n) : 0.0F;
  pose_ = pose;
  shear_all(1.0F);
}

}  // namespace tetap::slam
