// SPDX-License-Identifier: Apache-2.0
// The operations of a pose graph's optimisation job, one after another: order, screening of closures, rows,
// elimination, solution, judgement, adoption.
#pragma once

#include "tetap/slam/pose_graph.hpp"

namespace tetap::slam {

template <class Scalar_, int kPoses, int kEdges, int kBlocks>
int PoseGraph<Scalar_, kPoses, kEdges, kBlocks>::connect() {
  const Edge& edge = edge_[at(cursor_)];
  if (in_job(cursor_)) solver_.connect(static_cast<int>(edge.from) - 1, static_cast<int>(edge.to) - 1);
  if (++cursor_ < job_edges_) return 1;
  solver_.sort();
  phase_ = Phase::kOrder;
  return job_poses_;
}

template <class Scalar_, int kPoses, int kEdges, int kBlocks>
int PoseGraph<Scalar_, kPoses, kEdges, kBlocks>::order() {
  if (!solver_.ordered()) return solver_.order_step();
  if (!solver_.finish_order()) return end(GraphStatus::kNoRoom);
  begin_iteration();
  return solver_.cost_of_order();
}

/// The second attempt begins where odometry alone leads to, with the closures that it allows.
template <class Scalar_, int kPoses, int kEdges, int kBlocks>
void PoseGraph<Scalar_, kPoses, kEdges, kBlocks>::begin_second_attempt() {
  for (int e = 0; e < job_edges_; ++e) {
    const Edge& edge = edge_[at(e)];
    if (edge.closure == 0) trial_[edge.to] = trial_[edge.from].plus(edge.z);
  }
  attempt_ = 1;
  iteration_ = 0;
  cursor_ = 0;
  stage_ = Stage::kConsistent;
  solver_.begin_scratch();
  phase_ = Phase::kSpread;
}

/// One edge's part of how uncertain each pose is by odometry alone. It is written as a motion of the whole plane about
/// the first pose: the parts of a way add up there.
template <class Scalar_, int kPoses, int kEdges, int kBlocks>
int PoseGraph<Scalar_, kPoses, kEdges, kBlocks>::spread() {
  auto& spread = solver_.scratch();
  if (cursor_ == 0) spread[0] = {};
  const Edge& edge = edge_[at(cursor_)];
  if (edge.closure == 0) spread[edge.to] = on_plane(edge.covariance(), trial_[edge.from], spread[edge.from]);
  if (++cursor_ == job_edges_) cursor_ = 0, phase_ = Phase::kScreen;
  return 10;
}

/// A closure that odometry contradicts is off for now.
template <class Scalar_, int kPoses, int kEdges, int kBlocks>
int PoseGraph<Scalar_, kPoses, kEdges, kBlocks>::screen() {
  const auto& spread = solver_.scratch();
  Edge& edge = edge_[at(cursor_)];
  if (edge.closure != 0 && edge.refused == 0) {
    const Pose& from = trial_[edge.from];
    const bool later = edge.from < edge.to;
    const auto& more = spread[later ? edge.to : edge.from];
    const auto& less = spread[later ? edge.from : edge.to];
    filter::Symmetric<Scalar, 3> between;
    for (int c = 0; c < 3; ++c)
      for (int r = 0; r <= c; ++r) between(r, c) = more(r, c) - less(r, c);
    edge.off = consistent(edge, from, between) ? 0U : 1U;
  }
  if (++cursor_ == job_edges_) begin_iteration();
  return 20;
}

/// C of a displacement from `pose`, as a motion of the plane about the first pose; plus what was there.
template <class Scalar_, int kPoses, int kEdges, int kBlocks>
filter::Symmetric<Scalar_, 3> PoseGraph<Scalar_, kPoses, kEdges, kBlocks>::on_plane(
    const filter::Symmetric<Scalar, 3>& c, const Pose& pose, const filter::Symmetric<Scalar, 3>& sum) {
  const auto turn = pose.yaw.direction();
  return detail::turned(c, turn.cos, turn.sin, pose.y.metres(), -pose.x.metres(), Scalar{1}, sum);
}

template <class Scalar_, int kPoses, int kEdges, int kBlocks>
bool PoseGraph<Scalar_, kPoses, kEdges, kBlocks>::consistent(const Edge& edge, const Pose& from,
                                                             const filter::Symmetric<Scalar, 3>& between) const {
  const Pose& to = trial_[edge.to];
  const Displacement<Scalar> d = to.minus(from);
  // The motion of the plane about the first pose, as one of the displacement's end about `from`.
  const auto turn = from.yaw.direction();
  const Scalar x = to.x.metres(), y = to.y.metres();
  const auto in_world = detail::turned(between, Scalar{1}, Scalar{0}, -y, x, Scalar{1}, {});
  const auto s = detail::turned(in_world, turn.cos, -turn.sin, Scalar{0}, Scalar{0}, Scalar{1}, edge.covariance());
  std::array<Scalar, 6> w{};
  if (!whitening_of(s, w)) return true;
  const Edge test{.from = 0, .to = 0, .closure = 1, .off = 0, .left_out = 0, .refused = 0, .z = edge.z, .whitening = w};
  const auto r = test.whiten(d.x_m - edge.z.x_m, d.y_m - edge.z.y_m, (d.yaw - edge.z.yaw).radians());
  return r[0] * r[0] + r[1] * r[1] + r[2] * r[2] < Scalar{30};
}

template <class Scalar_, int kPoses, int kEdges, int kBlocks>
void PoseGraph<Scalar_, kPoses, kEdges, kBlocks>::begin_iteration() {
  solver_.begin_rows();
  sum_ = 0;
  cursor_ = 0;
  phase_ = Phase::kRows;
}

template <class Scalar_, int kPoses, int kEdges, int kBlocks>
int PoseGraph<Scalar_, kPoses, kEdges, kBlocks>::add_row() {
  const Edge& edge = edge_[at(cursor_)];
  const bool first_of_trial = trial_edge_ >= 0 && iteration_ == 0;
  if (first_of_trial && edge.refused == 0) trial_from_ += edge.chi2(trial_[edge.from], trial_[edge.to]);
  if (in_job(cursor_) && (edge.off == 0 || stage_ == Stage::kWeighted))
    solver_.add_row(cursor_, static_cast<int>(edge.from) - 1, static_cast<int>(edge.to) - 1);
  if (++cursor_ == job_edges_) phase_ = Phase::kEliminate;
  return first_of_trial ? 10 : 1;
}

template <class Scalar_, int kPoses, int kEdges, int kBlocks>
int PoseGraph<Scalar_, kPoses, kEdges, kBlocks>::eliminate() {
  const int cost = solver_.row_step(*this);
  if (!solver_.rows_done()) return cost;
  if (solver_.singular() || !detail::is_number(sum_)) return end(GraphStatus::kSingular);
  // Steps shrink by about the same share again and again, so what is left after this one can be foreseen.
  const Scalar decrease = solver_.decrease();
  const Scalar share = iteration_ == 0 || decrease > before_ ? Scalar{1} : decrease / before_;
  const float tolerance = stage_ == Stage::kPlain ? options_.tolerance : options_.weighted_tolerance;
  last_step_ = !(decrease * share > static_cast<Scalar>(tolerance) * sum_ + static_cast<Scalar>(1e-6));
  before_ = decrease;
  solver_.begin_solve();
  phase_ = Phase::kSolve;
  return cost;
}

template <class Scalar_, int kPoses, int kEdges, int kBlocks>
int PoseGraph<Scalar_, kPoses, kEdges, kBlocks>::solve() {
  const int cost = solver_.solve_step();
  if (solver_.solved()) cursor_ = 1, phase_ = Phase::kMove;
  return cost;
}

template <class Scalar_, int kPoses, int kEdges, int kBlocks>
int PoseGraph<Scalar_, kPoses, kEdges, kBlocks>::move() {
  const Scalar* const d = solver_.correction(cursor_ - 1);
  Pose& pose = trial_[at(cursor_)];
  if (!detail::is_number(d[0] + d[1] + d[2])) return end(GraphStatus::kSingular);
  pose = {pose.x.plus(d[0]), pose.y.plus(d[1]), pose.yaw + Heading<Scalar>::from_radians(d[2])};
  if (++cursor_ == job_poses_) {
    ++iteration_;
    ++total_iterations_;
    cursor_ = 0;
    judged_ = 0;
    out_ = 0;
    if (last_step_ || iteration_ == options_.iterations)
      end_stage();
    else
      begin_iteration();
  }
  return 2;
}

template <class Scalar_, int kPoses, int kEdges, int kBlocks>
void PoseGraph<Scalar_, kPoses, kEdges, kBlocks>::end_stage() {
  if (stage_ == Stage::kConsistent) {
    stage_ = Stage::kWeighted;
    iteration_ = 0;
    begin_iteration();
  } else {
    phase_ = Phase::kJudge;
  }
}

/// After the last step of a stage: one edge's squared error, and what it means for the next stage.
template <class Scalar_, int kPoses, int kEdges, int kBlocks>
int PoseGraph<Scalar_, kPoses, kEdges, kBlocks>::judge() {
  constexpr Scalar kNear = static_cast<Scalar>(9);  // three times the sigmas of an outlier
  Edge& edge = edge_[at(cursor_)];
  const Scalar chi2 = edge.chi2(trial_[edge.from], trial_[edge.to]);
  const auto limit = static_cast<Scalar>(options_.outlier_chi2) * (stage_ == Stage::kWeighted ? kNear : Scalar{1});
  if (stage_ != Stage::kPlain && edge.closure != 0) edge.off = chi2 > limit ? 1U : 0U;
  if (in_job(cursor_)) {
    if (edge.off == 0) judged_ += chi2;
    if (edge.off != 0 || (trial_edge_ >= 0 && edge.closure != 0 && chi2 > limit)) ++out_;
  }
  if (++cursor_ < job_edges_) return 10;
  if (stage_ == Stage::kPlain) return end_attempt();
  stage_ = stage_ == Stage::kWeighted ? Stage::kNear : Stage::kPlain;
  iteration_ = 0;
  begin_iteration();
  return 10;
}

/// The better attempt is kept. A second is made when this one left out more than was known to be false.
template <class Scalar_, int kPoses, int kEdges, int kBlocks>
int PoseGraph<Scalar_, kPoses, kEdges, kBlocks>::end_attempt() {
  const bool settled =
      judged_ <= sum_ * (Scalar{1} + static_cast<Scalar>(options_.weighted_tolerance)) + static_cast<Scalar>(1e-6);
  const bool converged = last_step_ && settled;
  if (trial_edge_ >= 0) return end_trial(converged);
  const Scalar cost = judged_ + static_cast<Scalar>(out_) * static_cast<Scalar>(options_.outlier_chi2);
  if (converged && cost < least_cost_) {
    least_cost_ = cost;
    adopt();
  }
  if (attempt_ == 0 && options_.robust && (out_ > known_false_ || !converged)) {
    begin_second_attempt();
    return 2 * job_edges_;
  }
  return end(least_cost_ < static_cast<Scalar>(1e30) ? GraphStatus::kConverged : GraphStatus::kNotConverged);
}

template <class Scalar_, int kPoses, int kEdges, int kBlocks>
int PoseGraph<Scalar_, kPoses, kEdges, kBlocks>::end_trial(bool converged) {
  if (converged && out_ == 0 && judged_ - trial_from_ < trial_most_) {
    edge_[at(trial_edge_)].refused = 0;
    --refused_;
    taken_ = true;
    status_ = GraphStatus::kConverged;
    adopt();
  }
  phase_ = Phase::kIdle;
  return 1;
}

template <class Scalar_, int kPoses, int kEdges, int kBlocks>
void PoseGraph<Scalar_, kPoses, kEdges, kBlocks>::adopt() {
  const Pose was = pose_[at(job_poses_ - 1)], is = trial_[at(job_poses_ - 1)];
  for (int i = job_poses_; i < poses_; ++i) pose_[at(i)] = is.plus(pose_[at(i)].minus(was));
  for (int i = 0; i < job_poses_; ++i) pose_[at(i)] = trial_[at(i)];
  for (int e = 0; e < job_edges_; ++e) edge_[at(e)].left_out = edge_[at(e)].off & (edge_[at(e)].refused ^ 1U);
  covariance_ = solver_.covariance_of_last();
  for (int i = job_poses_; i < poses_; ++i) carry_covariance(i);
  chi2_ = judged_;
  left_out_ = out_;
}

template <class Scalar_, int kPoses, int kEdges, int kBlocks>
int PoseGraph<Scalar_, kPoses, kEdges, kBlocks>::end(GraphStatus status) {
  if (trial_edge_ < 0) status_ = least_cost_ < static_cast<Scalar>(1e30) ? GraphStatus::kConverged : status;
  phase_ = Phase::kIdle;
  return 1;
}

/// Pose i came while the job ran; the edge that made it holds its odometry.
template <class Scalar_, int kPoses, int kEdges, int kBlocks>
void PoseGraph<Scalar_, kPoses, kEdges, kBlocks>::carry_covariance(int i) {
  for (int e = job_edges_; e < edges_; ++e) {
    const Edge& edge = edge_[at(e)];
    if (edge.closure != 0 || static_cast<int>(edge.to) != i) continue;
    const auto turn = pose_[at(i - 1)].yaw.direction();
    const auto added = detail::turned(edge.covariance(), turn.cos, turn.sin, Scalar{0}, Scalar{0}, Scalar{1}, {});
    const Scalar x = pose_[at(i)].x.minus(pose_[at(i - 1)].x), y = pose_[at(i)].y.minus(pose_[at(i - 1)].y);
    covariance_ = detail::turned(covariance_, Scalar{1}, Scalar{0}, -y, x, Scalar{1}, added);
  }
}

}  // namespace tetap::slam
