// SPDX-License-Identifier: Apache-2.0
#include "tetap/estimators/all_round/scan_clones.hpp"

#include "tetap/base/math.hpp"
#include "tetap/slam/graph_edge.hpp"

namespace tetap::estimators {

namespace {

std::array<float, 3> difference(const slam::Displacement<float>& a, const slam::Displacement<float>& b) {
  return {a.x_m - b.x_m, a.y_m - b.y_m, (a.yaw - b.yaw).radians()};
}

std::array<float, 3> product(const filter::Symmetric<float, 3>& m, const std::array<float, 3>& v) {
  std::array<float, 3> out{};
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) out[static_cast<std::size_t>(r)] += m(r, c) * v[static_cast<std::size_t>(c)];
  return out;
}

}  // namespace

DisplacementLikelihood DisplacementLikelihood::between(const slam::UncertainDisplacement<float>& prior,
                                                       const slam::UncertainDisplacement<float>& posterior) {
  DisplacementLikelihood z{.about = prior.mean, .information = {}};
  filter::Symmetric<float, 3> before, after;
  if (!slam::inverse_of(prior.covariance, before) || !slam::inverse_of(posterior.covariance, after)) return z;
  for (int c = 0; c < 3; ++c)
    for (int r = 0; r <= c; ++r) z.information(r, c) = after(r, c) - before(r, c);
  z.weighted = product(after, difference(posterior.mean, prior.mean));
  return z;
}

void ScanClones::forget() {
  const float variance = p_(kMount, kMount);
  column_ = {};
  p_ = {};
  p_(kMount, kMount) = variance;
  keyframe_held_ = scan_held_ = false;
}

void ScanClones::take_scan(const nav::Ins& ins, float later_s, float yaw_rate_radps,
                           const slam::Displacement<float>& mounting) {
  constexpr int kV = nav::InsState::kVelocity, kYaw = nav::InsState::kYaw;
  const float yaw_rad = nav::euler(ins.x.q_nb).yaw_rad + yaw_rate_radps * later_s;
  const base::SinCos turn = base::sincos(yaw_rad);
  const float lever_x_m = turn.cos * mounting.x_m - turn.sin * mounting.y_m;
  const float lever_y_m = turn.sin * mounting.x_m + turn.cos * mounting.y_m;
  scan_ = {.x = ins.x.x, .y = ins.x.y, .yaw_rad = base::wrap_angle(yaw_rad + mounting.yaw.radians() + mount_rad_)};
  nav::move(scan_.x, ins.x.v_n_mps(0) * later_s + lever_x_m);
  nav::move(scan_.y, ins.x.v_n_mps(1) * later_s + lever_y_m);
  scan_held_ = true;
  // Rows of the pose by the filter's errors; the mount turns it besides.
  const auto row = [&](int i, auto&& error) {
    if (i == 0) return error(0) + later_s * error(kV) - lever_y_m * error(kYaw);
    if (i == 1) return error(1) + later_s * error(kV + 1) + lever_x_m * error(kYaw);
    return error(kYaw);
  };
  for (int i = 0; i < 3; ++i)
    for (int n = 0; n < kErrors; ++n)
      column_[at(kScan + i)][at(n)] =
          row(i, [&](int k) { return ins.p(k, n); }) + (i == 2 ? column_[at(kMount)][at(n)] : 0.0F);
  const auto by = [&](int j) { return [this, j](int k) { return column_[at(j)][at(k)]; }; };
  for (int i = 0; i < 3; ++i) {
    for (const int j : {kKeyframe, kKeyframe + 1, kKeyframe + 2, kMount})
      p_(kScan + i, j) = row(i, by(j)) + (i == 2 ? p_(kMount, j) : 0.0F);
  }
  for (int i = 0; i < 3; ++i)
    for (int k = i; k < 3; ++k)
      p_(kScan + i, kScan + k) = row(k, by(kScan + i)) + (k == 2 ? p_(kScan + i, kMount) : 0.0F);
}

void ScanClones::keep_scan() {
  keyframe_ = scan_;
  keyframe_held_ = scan_held_;
  for (int i = 0; i < 3; ++i) {
    column_[at(kKeyframe + i)] = column_[at(kScan + i)];
    p_(kKeyframe + i, kMount) = p_(kScan + i, kMount);
    for (int k = 0; k < 3; ++k) {
      p_(kKeyframe + i, kScan + k) = p_(kScan + i, kScan + k);
      if (k >= i) p_(kKeyframe + i, kKeyframe + k) = p_(kScan + i, kScan + k);
    }
  }
}

namespace {

/// Rows of a displacement by the two poses, each x, y, yaw.
using Rows = std::array<std::array<float, 6>, 3>;
Rows rows_of(const slam::Displacement<float>& d, const base::SinCos& turn) {
  return {{{-turn.cos, -turn.sin, d.y_m, turn.cos, turn.sin, 0},
           {turn.sin, -turn.cos, -d.x_m, -turn.sin, turn.cos, 0},
           {0, 0, -1, 0, 0, 1}}};
}

}  // namespace

ScanClones::Step ScanClones::displacement() const {
  const base::SinCos turn = base::sincos(keyframe_.yaw_rad);
  const float east_m = nav::difference(scan_.x, keyframe_.x), north_m = nav::difference(scan_.y, keyframe_.y);
  Step d{.mean = {turn.cos * east_m + turn.sin * north_m, turn.cos * north_m - turn.sin * east_m,
                  slam::Heading<float>::from_radians(base::wrap_angle(scan_.yaw_rad - keyframe_.yaw_rad))},
         .covariance = {}};
  const Rows h = rows_of(d.mean, turn);
  for (int c = 0; c < 3; ++c)
    for (int r = 0; r <= c; ++r)
      for (int i = 0; i < 6; ++i)
        for (int k = 0; k < 6; ++k) d.covariance(r, c) += h[at(r)][at(i)] * p_(i, k) * h[at(c)][at(k)];
  return d;
}

void ScanClones::move(const std::array<float, kAll>& dx) {
  const auto by = [&dx](Pose& pose, int first) {
    nav::move(pose.x, dx[at(first)]);
    nav::move(pose.y, dx[at(first + 1)]);
    pose.yaw_rad = base::wrap_angle(pose.yaw_rad + dx[at(first + 2)]);
  };
  if (keyframe_held_) by(keyframe_, kKeyframe);
  if (scan_held_) by(scan_, kScan);
  mount_rad_ += dx[kMount];
}

void ScanClones::widen_turn(nav::Ins& ins, float sigma_rad, float interval_s) {
  const float east_m = nav::difference(scan_.x, keyframe_.x), north_m = nav::difference(scan_.y, keyframe_.y);
  const nav::Vector3 bias_b = ins.x.q_nb.conjugate().rotate(ins.earth.up_n) * (-1.0F / interval_s);
  Column by{-0.5F * north_m, 0.5F * east_m, 0, -ins.x.v_n_mps(1), ins.x.v_n_mps(0)};
  by[nav::InsState::kYaw] = 1;
  for (int i = 0; i < 3; ++i) by[at(nav::InsState::kGyroBias + i)] = bias_b(i);
  const std::array<float, 3> seen{by[0], by[1], 1};
  const float variance = sigma_rad * sigma_rad;
  for (int c = 0; c < kErrors; ++c)
    for (int r = 0; r <= c; ++r) ins.p(r, c) += variance * by[at(r)] * by[at(c)];
  for (int i = 0; i < 3; ++i) {
    for (std::size_t n = 0; n < kErrors; ++n) column_[at(kScan + i)][n] += variance * seen[at(i)] * by[n];
    for (int k = i; k < 3; ++k) p_(kScan + i, kScan + k) += variance * seen[at(i)] * seen[at(k)];
  }
}

Innovation ScanClones::fuse(nav::Ins& ins, const DisplacementLikelihood& z, float gate_scale) {
  constexpr float kLeast = 1e-4F;  // share of a diagonal of the information below which there is none
  const slam::Displacement<float> d = displacement().mean;
  const Rows by = rows_of(d, base::sincos(keyframe_.yaw_rad));
  std::array<float, 3> left = product(z.information, difference(d, z.about));
  for (std::size_t i = 0; i < 3; ++i) left[i] = z.weighted[i] - left[i];
  // Rows of the factor's transpose are measurements of unit noise, each as far as the ones before leave something.
  std::array<std::array<float, 3>, 3> l{};
  std::array<std::array<float, 6>, 3> h{};
  std::array<float, 3> nu{};
  int rows = 0;
  for (int j = 0; j < 3; ++j) {
    float pivot = z.information(j, j), y = left[at(j)];
    for (int k = 0; k < rows; ++k) pivot -= l[at(j)][at(k)] * l[at(j)][at(k)], y -= l[at(j)][at(k)] * nu[at(k)];
    if (!(pivot > kLeast * z.information(j, j)) || !(pivot < 1e12F)) continue;
    const float root = base::sqrt(pivot);
    nu[at(rows)] = y / root;
    for (int i = j; i < 3; ++i) {
      float sum = z.information(i, j);
      for (int k = 0; k < rows; ++k) sum -= l[at(i)][at(k)] * l[at(j)][at(k)];
      l[at(i)][at(rows)] = sum / root;
      for (std::size_t k = 0; k < 6; ++k) h[at(rows)][k] += l[at(i)][at(rows)] * by[at(i)][k];
    }
    ++rows;
  }
  Innovation record{.verdict = sensor::Verdict::kSingular, .failed = sensor::Check::kValue};
  if (rows == 0) return record;
  // The joint gate.
  const auto seen = [&](int row, int j) {  // covariance of a row with a clone's error
    float sum = 0;
    for (int k = 0; k < 6; ++k) sum += h[at(row)][at(k)] * p_(k, j);
    return sum;
  };
  std::array<std::array<float, 3>, 3> s{};
  std::array<float, 3> white{};
  record.dof = static_cast<std::uint8_t>(rows);
  for (int j = 0; j < rows; ++j) {
    float y = nu[at(j)];
    for (int i = 0; i <= j; ++i) {
      float sum = i == j ? 1.0F : 0.0F;
      for (int k = 0; k < 6; ++k) sum += seen(j, k) * h[at(i)][at(k)];
      for (int k = 0; k < i; ++k) sum -= s[at(j)][at(k)] * s[at(i)][at(k)];
      if (i < j) s[at(j)][at(i)] = sum / s[at(i)][at(i)];
      if (i == j && !(sum > 0.0F && sum < 1e20F)) return record;
      if (i == j) s[at(j)][at(j)] = base::sqrt(sum);
    }
    for (int k = 0; k < j; ++k) y -= s[at(j)][at(k)] * white[at(k)];
    white[at(j)] = y / s[at(j)][at(j)];
    record.nis += white[at(j)] * white[at(j)];
  }
  record.gate = gate_scale * filter::chi_square_99(rows);
  record.failed = sensor::Check::kGate;
  record.verdict = sensor::Verdict::kRejected;
  if (!(record.nis <= record.gate)) return record;

  nav::InsState::Error dx = nav::InsState::Error::Zero();
  std::array<float, kAll> moved{};
  for (int row = 0; row < rows; ++row) {
    std::array<float, kAll> clone{};
    Column state{};
    float variance = 1, off = nu[at(row)];
    for (int j = 0; j < kAll; ++j) clone[at(j)] = seen(row, j);
    for (int k = 0; k < 6; ++k) {
      variance += h[at(row)][at(k)] * clone[at(k)];
      off -= h[at(row)][at(k)] * moved[at(k)];
      for (std::size_t n = 0; n < kErrors; ++n) state[n] += h[at(row)][at(k)] * column_[at(k)][n];
    }
    const float scale = 1.0F / variance;
    for (int c = 0; c < kErrors; ++c) {
      const float gain = scale * state[at(c)];
      dx(c) += gain * off;
      for (int r = 0; r <= c; ++r) ins.p(r, c) -= gain * state[at(r)];
      for (int j = 0; j < kAll; ++j) column_[at(j)][at(c)] -= gain * clone[at(j)];
    }
    for (int c = 0; c < kAll; ++c) {
      const float gain = scale * clone[at(c)];
      moved[at(c)] += gain * off;
      for (int r = 0; r <= c; ++r) p_(r, c) -= gain * clone[at(r)];
    }
  }
  ins.take(dx);
  move(moved);
  record.verdict = sensor::Verdict::kAccepted;
  record.failed = sensor::Check::kNone;
  return record;
}

}  // namespace tetap::estimators
