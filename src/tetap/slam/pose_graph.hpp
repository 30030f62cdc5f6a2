// SPDX-License-Identifier: Apache-2.0
// A graph of planar poses in fixed memory. Poses are appended as they come, closures wait for the next optimisation. An
// optimisation is a job cut in units of work (Gauss-Newton on the square-root information; Dellaert & Kaess, IJRR
// 25(12), 2006). False closures are held off by dynamic covariance scaling, then left out (see graph_edge.hpp). A
// closure that was refused stays where there is room, and counts for nothing until a trial of it fits.
#pragma once

#include "tetap/slam/graph_edge.hpp"

namespace tetap::slam {

enum class GraphStatus : std::uint8_t {
  kNone,          ///< nothing was optimised yet
  kConverged,     ///< the sum of squares falls no more
  kNotConverged,  ///< iterations ran out, or the sum of squares rose at the end: the poses are left as they were
  kSingular,      ///< some pose is held by nothing, or something is no number: likewise
  kNoRoom,        ///< rows and fronts do not fit kBlocks: likewise
};

struct GraphOptions {
  bool robust = true;                ///< closures may be false
  float phi = 1.0F;                  ///< dynamic covariance scaling: squared error from which a closure loses weight
  float outlier_chi2 = 11.345F;      ///< a closure above is left out at the end: 99 % of chi-square with 3 degrees
  int iterations = 30;               ///< at most, of each of the two kinds
  float tolerance = 2e-7F;           ///< converged: the share of the sum of squares that another step may take
  float weighted_tolerance = 1e-3F;  ///< likewise while closures are weighted
};

/// Up to kPoses poses (the first is fixed), kEdges measurements, and kBlocks 3 x 3 blocks of memory for the job.
template <class Scalar_, int kPoses, int kEdges, int kBlocks>
class PoseGraph {
  static_assert(kPoses >= 2 && kPoses <= 0x4000);

 public:
  using Scalar = Scalar_;
  using Pose = GraphPose<Scalar>;
  using Motion = UncertainDisplacement<Scalar>;
  using Edge = GraphEdge<Scalar>;

  explicit PoseGraph(const GraphOptions& options = {}) : options_(options) {}

  /// Back to one pose, at the origin. A job is aborted.
  void clear() {
    cancel();
    poses_ = 1;
    edges_ = 0;
    pose_[0] = {};
    covariance_ = {};
    status_ = GraphStatus::kNone;
    chi2_ = 0;
    left_out_ = 0;
    refused_ = 0;
  }
  [[nodiscard]] int poses() const { return poses_; }
  [[nodiscard]] int edges() const { return edges_; }
  /// Closures that count, and those that were refused.
  [[nodiscard]] int closures() const { return edges_ - (poses_ - 1) - refused_; }
  [[nodiscard]] int refused() const { return refused_; }
  [[nodiscard]] bool has_room_for_pose() const { return poses_ < kPoses && edges_ < kEdges; }
  [[nodiscard]] const Pose& pose(int i) const { return pose_[at(i)]; }
  [[nodiscard]] const Edge& edge(int e) const { return edge_[at(e)]; }
  /// Last pose, relative to the first; as of the latest job, carried on by odometry since.
  [[nodiscard]] const filter::Symmetric<Scalar, 3>& covariance_of_last() const { return covariance_; }

  /// A new pose at the end of odometry from the last one. False, and nothing has changed, when there is no room or the
  /// motion is no number or its covariance not positive definite.
  [[nodiscard]] bool append(const Motion& odometry) {
    if (poses_ == kPoses || !add_edge(poses_ - 1, poses_, odometry, false)) return false;
    const Pose& last = pose_[at(poses_ - 1)];
    const auto turn = last.yaw.direction();
    const Scalar c = turn.cos, s = turn.sin;
    const Scalar x = c * odometry.mean.x_m - s * odometry.mean.y_m, y = s * odometry.mean.x_m + c * odometry.mean.y_m;
    const auto added = detail::turned(odometry.covariance, c, s, Scalar{0}, Scalar{0}, Scalar{1}, {});
    covariance_ = detail::turned(covariance_, Scalar{1}, Scalar{0}, -y, x, Scalar{1}, added);
    pose_[at(poses_)] = last.plus(odometry.mean);
    ++poses_;
    return true;
  }
  /// Pose j as seen from pose i. False, and nothing has changed, as for append(), or when a pose is not there.
  [[nodiscard]] bool close(int i, int j, const Motion& z) {
    if (i < 0 || j < 0 || i >= poses_ || j >= poses_ || i == j || !add_edge(i, j, z, true)) return false;
    if (!busy()) join(edges_ - 1);
    return true;
  }
  /// The same for a closure that counts for nothing yet.
  [[nodiscard]] bool keep_refused(int i, int j, const Motion& z) {
    if (i < 0 || j < 0 || i >= poses_ || j >= poses_ || i == j || !add_edge(i, j, z, true)) return false;
    edge_[at(edges_ - 1)].refused = 1;
    ++refused_;
    return true;
  }
  /// Closures that the latest job left out are refused from now on; their number. Nothing while a job runs.
  int refuse_left_out() {
    int count = 0;
    for (int e = 0; e < edges_ && !busy(); ++e) {
      if (edge_[at(e)].left_out == 0) continue;
      edge_[at(e)].left_out = 0;
      edge_[at(e)].refused = 1;
      ++count;
    }
    refused_ += count;
    left_out_ -= count;
    return count;
  }
  /// Forgets so many refused closures, the oldest first; their number. Nothing while a job runs.
  int forget_refused(int most) {
    int count = 0;
    for (int e = 0; e < edges_ && count < most && !busy();) {
      if (edge_[at(e)].refused != 0)
        remove_edge(e), ++count;
      else
        ++e;
    }
    return count;
  }
  /// The place of the next refused closure from place e on, or -1.
  [[nodiscard]] int next_refused(int e) const {
    while (e < edges_ && edge_[at(e)].refused == 0) ++e;
    return e < edges_ ? e : -1;
  }
  /// Implements docs/explanation/pose_graph.md (7) for an edge.
  [[nodiscard]] Scalar contradiction(int e) const {
    const Edge& edge = edge_[at(e)];
    return contradiction(static_cast<int>(edge.from), static_cast<int>(edge.to), motion(e));
  }

  /// Implements docs/explanation/pose_graph.md (7).
  /// The squared error of closing i and j so, by the covariance of the closure and of the odometry between them. It is
  /// of chi-square with 3 degrees if the closure is true, and negative when it is no number. Cost: a composition a
  /// pose.
  [[nodiscard]] Scalar contradiction(int i, int j, const Motion& z) const {
    const int first = i < j ? i : j, last = i < j ? j : i;
    Motion between{};
    for (int e = 0; e < edges_; ++e) {
      const Edge& edge = edge_[at(e)];
      if (edge.closure != 0 || static_cast<int>(edge.from) < first || static_cast<int>(edge.to) > last) continue;
      between = compose(between, {.mean = edge.z, .covariance = edge.covariance()});
    }
    if (i > j) between = inverse(between);
    Edge test{};
    for (int c = 0; c < 3; ++c)
      for (int r = 0; r <= c; ++r) between.covariance(r, c) += z.covariance(r, c);
    test.z = z.mean;
    if (!z.mean.valid() || !whitening_of(between.covariance, test.whitening)) return Scalar{-1};
    return test.chi2(pose_[at(i)], pose_[at(j)]);
  }

  /// Takes a pose out. The odometry before and after becomes one measurement. Its closures move to the pose before it
  /// through odometry (Smith, Self & Cheeseman 1990). Closures that then join the same poses are merged. False, and
  /// nothing changes, for the first and the last pose, and while a job runs.
  [[nodiscard]] bool compose_away(int k) {
    if (busy() || k < 1 || k >= poses_ - 1) return false;
    const int incoming = odometry_to(k), outgoing = odometry_to(k + 1);
    const Motion before = motion(incoming);
    if (!set(outgoing, k - 1, k + 1, compose(before, motion(outgoing)))) return false;
    for (int e = edges_ - 1; e >= 0; --e) {
      const Edge& edge = edge_[at(e)];
      const int from = static_cast<int>(edge.from), to = static_cast<int>(edge.to);
      if (edge.closure == 0 || (from != k && to != k)) continue;
      const bool moved = from == k ? set(e, k - 1, to, compose(before, motion(e)))
                                   : set(e, from, k - 1, compose(motion(e), inverse(before)));
      if (!moved)
        remove_edge(e), ++lost_;
      else
        join(e);
    }
    remove_edge(odometry_to(k));
    for (int i = k; i + 1 < poses_; ++i) pose_[at(i)] = pose_[at(i + 1)];
    --poses_;
    for (int e = 0; e < edges_; ++e) {
      if (static_cast<int>(edge_[at(e)].from) > k) edge_[at(e)].from = (edge_[at(e)].from - 1U) & 0x3fffU;
      if (static_cast<int>(edge_[at(e)].to) > k) edge_[at(e)].to = (edge_[at(e)].to - 1U) & 0x3fffU;
    }
    return true;
  }
  /// Removes the `most` newest closures that count; nothing while a job runs.
  int remove_closures(int most) {
    int removed = 0;
    for (int e = busy() ? -1 : edges_ - 1; e >= 0 && removed < most; --e)
      if (edge_[at(e)].closure != 0 && edge_[at(e)].refused == 0) remove_edge(e), ++removed;
    return removed;
  }
  /// Covariance of the odometry that leads to a pose.
  [[nodiscard]] filter::Symmetric<Scalar, 3> odometry_covariance(int pose) const {
    return edge_[at(odometry_to(pose))].covariance();
  }
  /// Closures that count and begin or end at a pose.
  [[nodiscard]] std::uint32_t closures_of(int pose) const {
    std::uint32_t count = 0;
    for (int e = 0; e < edges_; ++e) {
      const Edge& edge = edge_[at(e)];
      if (edge.closure == 0 || edge.refused != 0) continue;
      if (static_cast<int>(edge.from) == pose || static_cast<int>(edge.to) == pose) ++count;
    }
    return count;
  }
  [[nodiscard]] std::uint32_t merged() const { return merged_; }  ///< closures that became one with another
  [[nodiscard]] std::uint32_t lost() const { return lost_; }      ///< closures that another one contradicted
  /// Begins an optimisation of what is there now; poses and closures that come later are carried along and wait for the
  /// next. False when a job is running or there is nothing to do.
  [[nodiscard]] bool begin() {
    if (phase_ != Phase::kIdle || poses_ < 2) return false;
    trial_edge_ = -1;
    taken_ = false;
    job_poses_ = poses_;
    job_edges_ = edges_;
    for (int i = 0; i < poses_; ++i) trial_[at(i)] = pose_[at(i)];
    solver_.begin(poses_ - 1);
    stage_ = options_.robust && closures() > 0 ? Stage::kWeighted : Stage::kPlain;
    attempt_ = 0;
    least_cost_ = static_cast<Scalar>(1e30);
    known_false_ = left_out_;
    iteration_ = 0;
    total_iterations_ = 0;
    cursor_ = 0;
    last_step_ = false;
    for (int e = 0; e < edges_; ++e) edge_[at(e)].off = 0;
    phase_ = Phase::kConnect;
    return true;
  }
  /// Begins a trial of the refused closure e, from the poses of the latest job: least squares with it and without
  /// weights. It is taken, and the poses with it, when the sum of squares rises by less than `most` and no closure then
  /// is an outlier. Otherwise nothing changes, nor does status().
  [[nodiscard]] bool begin_trial(int e, Scalar most) {
    if (e < 0 || e >= edges_ || edge_[at(e)].refused == 0 || !begin()) return false;
    trial_edge_ = e;
    trial_most_ = most;
    trial_from_ = 0;
    stage_ = Stage::kPlain;
    attempt_ = 1;
    return true;
  }
  /// Whether the latest job was a trial, and whether that took its closure.
  [[nodiscard]] bool tried() const { return trial_edge_ >= 0; }
  [[nodiscard]] bool taken() const { return taken_; }
  [[nodiscard]] bool busy() const { return phase_ != Phase::kIdle; }
  /// Poses that the elimination at hand has before it, at least one while a job runs or may begin.
  [[nodiscard]] int rows_left() const { return phase_ == Phase::kEliminate ? solver_.rows_left() : 1; }
  /// Up to so many units of the job, a unit being about ten floating-point operations. An operation that is begun is
  /// ended, and the excess is taken from the next call. The result is the same however the units are dealt.
  void work(int units) {
    credit_ += units;
    while (credit_ > 0 && busy()) credit_ -= step();
    if (!busy()) credit_ = 0;
  }
  /// Forgets the job. Poses stay as they are.
  void cancel() {
    phase_ = Phase::kIdle;
    credit_ = 0;
  }
  /// Status of the latest job that ended.
  [[nodiscard]] GraphStatus status() const { return status_; }
  [[nodiscard]] Scalar chi2() const { return chi2_; }       ///< sum over the measurements that were not left out
  [[nodiscard]] int left_out() const { return left_out_; }  ///< closures taken for false
  [[nodiscard]] int iterations() const { return total_iterations_; }  ///< steps in all stages and attempts
  [[nodiscard]] std::uint32_t blocks_used() const { return solver_.blocks_used(); }

  /// For SquareRoot: the rows of edge e at the trial poses, and the nodes they touch.
  struct Nodes {
    int first, second;
  };
  Nodes linearise(int e, BlockRow<Scalar>& row) const {
    const Edge& edge = edge_[at(e)];
    Scalar chi2 = edge.linearise(trial_[edge.from], trial_[edge.to], row);
    if (stage_ == Stage::kWeighted && edge.closure != 0) {
      const Scalar scale = dynamic_scale(chi2, static_cast<Scalar>(options_.phi));
      chi2 *= scale * scale;
      for (std::size_t r = 0; r < 3; ++r) {
        for (std::size_t c = 0; c < 3; ++c) row.of_first[r][c] *= scale, row.of_second[r][c] *= scale;
        row.rest[r] *= scale;
      }
    }
    sum_ += chi2;
    return {static_cast<int>(edge.from) - 1, static_cast<int>(edge.to) - 1};
  }

 private:
  /// Closures that count: those that odometry allows, all by weight, those that are not far off, those that fit.
  enum class Stage : std::uint8_t { kConsistent, kWeighted, kNear, kPlain };
  enum class Phase : std::uint8_t {
    kIdle,
    kConnect,
    kOrder,
    kSpread,
    kScreen,
    kRows,
    kEliminate,
    kSolve,
    kMove,
    kJudge
  };
  static constexpr std::size_t at(int i) { return static_cast<std::size_t>(i); }

  [[nodiscard]] Motion motion(int e) const { return {.mean = edge_[at(e)].z, .covariance = edge_[at(e)].covariance()}; }
  [[nodiscard]] bool set(int e, int i, int j, const Motion& z) {
    std::array<Scalar, 6> whitening{};
    if (!whitening_of(z.covariance, whitening)) return false;
    Edge& edge = edge_[at(e)];
    edge.from = static_cast<std::uint32_t>(i) & 0x3fffU;
    edge.to = static_cast<std::uint32_t>(j) & 0x3fffU;
    edge.z = z.mean;
    edge.whitening = whitening;
    return true;
  }
  [[nodiscard]] int odometry_to(int pose) const {
    int e = 0;
    while (e < edges_ && (edge_[at(e)].closure != 0 || static_cast<int>(edge_[at(e)].to) != pose)) ++e;
    return e;
  }
  /// Whether edge e is part of the job at hand.
  [[nodiscard]] bool in_job(int e) const { return edge_[at(e)].refused == 0 || e == trial_edge_; }
  void remove_edge(int e) {
    refused_ -= static_cast<int>(edge_[at(e)].refused);
    for (int k = e; k + 1 < edges_; ++k) edge_[at(k)] = edge_[at(k + 1)];
    --edges_;
  }
  /// Closure e, as one with another that joins the same poses; it goes where it joins a pose with itself.
  void join(int e) {
    if (edge_[at(e)].from == edge_[at(e)].to) {
      remove_edge(e);
      ++merged_;
      return;
    }
    for (int other = 0; other < edges_; ++other) {
      Edge& into = edge_[at(other)];
      if (other == e || into.closure == 0 || (into.refused | edge_[at(e)].refused) != 0) continue;
      const bool same = into.from == edge_[at(e)].from && into.to == edge_[at(e)].to;
      const bool opposite = into.from == edge_[at(e)].to && into.to == edge_[at(e)].from;
      if (!same && !opposite) continue;
      if (opposite && !set(e, static_cast<int>(into.from), static_cast<int>(into.to), inverse(motion(e)))) continue;
      if (merge(into, edge_[at(e)], static_cast<Scalar>(options_.outlier_chi2)))
        ++merged_;
      else
        ++lost_;
      remove_edge(e);
      return;
    }
  }

  [[nodiscard]] bool add_edge(int i, int j, const Motion& z, bool closure) {
    std::array<Scalar, 6> whitening{};
    if (edges_ == kEdges || !z.mean.valid() || !whitening_of(z.covariance, whitening)) return false;
    edge_[at(edges_)] = {.from = static_cast<std::uint32_t>(i) & 0x3fffU,
                         .to = static_cast<std::uint32_t>(j) & 0x3fffU,
                         .closure = closure ? 1U : 0U,
                         .off = 0,
                         .left_out = 0,
                         .refused = 0,
                         .z = z.mean,
                         .whitening = whitening};
    ++edges_;
    return true;
  }

  /// The next operation of the job; its cost.
  int step() {
    switch (phase_) {
      case Phase::kIdle:
        return 0;
      case Phase::kConnect:
        return connect();
      case Phase::kOrder:
        return order();
      case Phase::kSpread:
        return spread();
      case Phase::kScreen:
        return screen();
      case Phase::kRows:
        return add_row();
      case Phase::kEliminate:
        return eliminate();
      case Phase::kSolve:
        return solve();
      case Phase::kMove:
        return move();
      case Phase::kJudge:
        break;
    }
    return judge();
  }

  int connect();
  int order();
  void begin_second_attempt();
  int spread();
  int screen();
  static filter::Symmetric<Scalar, 3> on_plane(const filter::Symmetric<Scalar, 3>& c, const Pose& pose,
                                               const filter::Symmetric<Scalar, 3>& sum);
  [[nodiscard]] bool consistent(const Edge& edge, const Pose& from, const filter::Symmetric<Scalar, 3>& between) const;
  void begin_iteration();
  int add_row();
  int eliminate();
  int solve();
  int move();
  void end_stage();
  int judge();
  int end_attempt();
  int end_trial(bool converged);
  void adopt();
  int end(GraphStatus status);
  void carry_covariance(int i);

  GraphOptions options_;
  int poses_ = 1;
  int edges_ = 0;
  std::array<Pose, kPoses> pose_{};
  std::array<Edge, kEdges> edge_{};
  filter::Symmetric<Scalar, 3> covariance_{};
  GraphStatus status_ = GraphStatus::kNone;
  Scalar chi2_ = 0;
  int left_out_ = 0, refused_ = 0;
  std::uint32_t merged_ = 0, lost_ = 0;
  int total_iterations_ = 0;

  Phase phase_ = Phase::kIdle;
  Stage stage_ = Stage::kPlain;
  bool last_step_ = false;
  int credit_ = 0, cursor_ = 0, iteration_ = 0, job_poses_ = 0, job_edges_ = 0, out_ = 0, attempt_ = 0,
      known_false_ = 0, trial_edge_ = -1;
  bool taken_ = false;
  Scalar trial_most_ = 0, trial_from_ = 0;  ///< a trial: the rise that it may cost, the sum of squares before it
  Scalar least_cost_ = 0, before_ = 0;
  mutable Scalar sum_ = 0;  ///< squares summed at the trial poses
  Scalar judged_ = 0;       ///< likewise, after the last step
  std::array<Pose, kPoses> trial_{};
  SquareRoot<Scalar, kPoses - 1, kEdges, kBlocks> solver_{};
};

}  // namespace tetap::slam

#include "tetap/slam/pose_graph_job.hpp"
