// SPDX-License-Identifier: Apache-2.0
// A pose graph that never ends. Odometry becomes keyframes, and closures between any two steps are moved to the nearest
// ones. A graph too large for its room is thinned out in three stages, each counted. A keyframe is not made; a keyframe
// is composed away and closures of the same pair are merged; a closure is refused. A closure that is contradicted is
// judged again whenever others moved the graph.
#pragma once

#include "tetap/slam/pose_graph.hpp"

namespace tetap::slam {

struct KeyframeOptions {
  float distance_m = 0.0F;      ///< a keyframe is made after so much way
  float turn_rad = 0.0F;        ///< a keyframe is made after so much turn; both 0: each step
  float contradiction = 30.0F;  ///< a closure above, by odometry's covariance, is refused
  int closures_a_job = 1;       ///< a job begins by itself when so many came
  GraphOptions graph;
};

struct KeyframeCounters {
  std::uint32_t skipped = 0;        ///< stage 1: steps that wanted a keyframe and got none
  std::uint32_t composed_away = 0;  ///< stage 2
  std::uint32_t refused = 0;        ///< stage 3: closures without room
  std::uint32_t contradicted = 0;   ///< closures that odometry or later closures made false at some time
  std::uint32_t taken_later = 0;    ///< those of them that were right in the end
  std::uint32_t unknown = 0;        ///< closures that name steps long gone, or none
  std::uint32_t invalid = 0;        ///< inputs that are no number or no covariance
  std::uint32_t trials = 0;         ///< trials of contradicted closures
  std::uint32_t jobs = 0, jobs_without_room = 0, jobs_not_converged = 0, jobs_aborted = 0;
};

/// Fate of a closure.
enum class ClosureFate : std::uint8_t {
  kTaken,
  kNothingNew,    ///< both ends belong to one keyframe
  kInvalid,       ///< no number, or no covariance
  kUnknown,       ///< an end is a step long gone, or none
  kContradicted,  ///< by odometry and the closures before
  kNoRoom
};
template <class Scalar>
struct ClosureRecord {
  ClosureFate fate = ClosureFate::kInvalid;
  Scalar contradiction = -1;  ///< squared error by all covariances; negative: not compared
  [[nodiscard]] explicit operator bool() const {
    return fate == ClosureFate::kTaken || fate == ClosureFate::kNothingNew;
  }
};

/// Sizes as PoseGraph's, and kTrail steps of odometry that closures may name.
template <class Scalar_, int kPoses, int kEdges, int kBlocks, int kTrail>
class KeyframeGraph {
 public:
  using Scalar = Scalar_;
  using Graph = PoseGraph<Scalar, kPoses, kEdges, kBlocks>;
  using Pose = typename Graph::Pose;
  using Motion = typename Graph::Motion;

  explicit KeyframeGraph(const KeyframeOptions& options = {}) : options_(options), graph_(options.graph) {}

  /// One step of odometry: step() + 1. False, and nothing has changed, when it is no number or no covariance.
  bool odometry(const Motion& motion) {
    std::array<Scalar, 6> whitening{};
    if (!motion.mean.valid() || !whitening_of(motion.covariance, whitening)) return ++count_.invalid, false;
    ++step_;
    trail_[step_ % kTrail] = Step::of(motion.mean);
    pending_ = step_ == id_[at(graph_.poses() - 1)] + 1 ? motion : compose(pending_, motion);
    if (keyframe_due()) make_keyframe();
    return true;
  }

  /// Step j as seen from step i. A closure that is not taken is counted.
  ClosureRecord<Scalar> closure(std::uint32_t i, std::uint32_t j, const Motion& z) {
    using enum ClosureFate;
    std::array<Scalar, 6> whitening{};
    if (!z.mean.valid() || !whitening_of(z.covariance, whitening)) return ++count_.invalid, record(kInvalid);
    Link link;
    if (!between_keyframes(i, j, z, link)) return ++count_.unknown, record(kUnknown);
    if (link.a == link.b) return record(kNothingNew);
    const Scalar squared = graph_.contradiction(link.a, link.b, link.z);
    if (!(squared >= Scalar{0} && squared < static_cast<Scalar>(options_.contradiction))) {
      keep_for_later(link);
      return ++count_.contradicted, record(kContradicted, squared);
    }
    if (graph_.edges() >= kEdges - 1 && graph_.forget_refused(1) == 0) {  // one is kept for odometry
      give_way();
      if (!thin() || !between_keyframes(i, j, z, link)) return ++count_.refused, record(kNoRoom, squared);
      if (link.a == link.b) return record(kNothingNew, squared);
    }
    if (!graph_.close(link.a, link.b, link.z)) return ++count_.refused, record(kNoRoom, squared);
    ++waiting_;
    return record(kTaken, squared);
  }

  /// A share of the job; begins one when closures came since the last. Room for what comes while it runs is made first,
  /// a keyframe a call.
  void work(int units) {
    if (graph_.busy() && graph_.tried() && (waiting_ >= options_.closures_a_job || nearly_full())) cancel_job();
    if (!graph_.busy()) {
      keep_share_free();
      const bool due = to_thin_ > 0 || nearly_full();
      if (to_thin_ > 0) --to_thin_;
      if (waiting_ > 0 && due && thin()) return;
      if (waiting_ >= options_.closures_a_job && waiting_ > 0) {
        if (!graph_.begin()) return;
        waiting_ = 0;
      } else if (!begin_trial()) {
        return;
      }
    }
    graph_.work(units);
    if (!graph_.busy()) end_job();
  }
  /// An optimisation of all closures runs or is due; a trial of a refused one is none.
  [[nodiscard]] bool optimising() const {
    return (graph_.busy() && !graph_.tried()) || waiting_ >= options_.closures_a_job;
  }
  [[nodiscard]] bool idle() const {
    return !graph_.busy() && waiting_ < options_.closures_a_job && (to_judge_ == 0 || waiting_ > 0 || !settled_);
  }
  /// The next work() begins a job, however few closures came.
  void optimise() { waiting_ = options_.closures_a_job > waiting_ ? options_.closures_a_job : waiting_; }

  /// The job under way is given up, and another begins with the next work().
  void cancel_job() {
    if (!graph_.busy()) return;
    graph_.cancel();
    if (graph_.tried()) return judge_all_again();
    ++count_.jobs_aborted;
    optimise();
  }

  /// Pose of the latest step.
  [[nodiscard]] Pose pose() const { return placed(local()); }
  /// Covariance of the latest step relative to the first, along the axes in which pose() is.
  [[nodiscard]] filter::Symmetric<Scalar, 3> covariance() const {
    filter::Symmetric<Scalar, 3> c = graph_.covariance_of_last();
    const int last = graph_.poses() - 1;
    if (step_ != id_[at(last)]) c = carried(c, graph_.pose(last), pending_);
    const auto turn = origin_.yaw.direction();
    return detail::turned(c, turn.cos, turn.sin, Scalar{0}, Scalar{0}, Scalar{1}, {});
  }
  /// C of a pose, carried on by a displacement from it.
  [[nodiscard]] static filter::Symmetric<Scalar, 3> carried(const filter::Symmetric<Scalar, 3>& c, const Pose& from,
                                                            const Motion& by) {
    const auto turn = from.yaw.direction();
    const Scalar x = turn.cos * by.mean.x_m - turn.sin * by.mean.y_m;
    const Scalar y = turn.sin * by.mean.x_m + turn.cos * by.mean.y_m;
    const auto added = detail::turned(by.covariance, turn.cos, turn.sin, Scalar{0}, Scalar{0}, Scalar{1}, {});
    return detail::turned(c, Scalar{1}, Scalar{0}, -y, x, Scalar{1}, added);
  }
  /// Way of a step of the trail, in 2 mm; false: not known any more, or too far.
  [[nodiscard]] bool trail(std::uint32_t step, Displacement<Scalar>& way) const {
    if (step == 0 || step > step_ || step_ - step >= static_cast<std::uint32_t>(kTrail)) return false;
    if (!trail_[step % kTrail].known()) return false;
    way = trail_[step % kTrail].displacement();
    return true;
  }
  [[nodiscard]] Pose keyframe(int k) const { return placed(graph_.pose(k)); }
  [[nodiscard]] std::uint32_t keyframe_step(int k) const { return id_[at(k)]; }
  [[nodiscard]] std::uint32_t step() const { return step_; }
  [[nodiscard]] const Graph& graph() const { return graph_; }
  [[nodiscard]] const KeyframeCounters& counters() const { return count_; }

  /// Moves the whole graph so that the latest step is there: poses keep where they are to each other.
  void set_pose(const Pose& pose) {
    const Displacement<Scalar> to_first = Pose{}.minus(local());
    origin_ = pose.plus(to_first);
  }
  /// Forgets everything but the counters.
  void reset() {
    if (graph_.busy()) ++count_.jobs_aborted;
    graph_.clear();
    step_ = 0;
    id_[0] = 0;
    origin_ = {};
    waiting_ = to_thin_ = to_judge_ = 0;
    settled_ = true;
  }

 private:
  static constexpr int kMostRefused = kEdges / 8;  ///< closures that wait to be judged again
  static constexpr Scalar kNear = 10;  ///< share of the limit for a trial: far from the optimum (7) is not linear
  static constexpr int kLeastPoses = kPoses / 4;  ///< keyframes that stay for want of room in a job
  /// A step of odometry in 2 mm and 2^-16 turns: closures are known to less.
  struct Step {
    static constexpr Scalar kUnit_m = static_cast<Scalar>(0.002F);
    std::int16_t x = 0, y = 0, yaw = 0;

    static Step of(const Displacement<Scalar>& d) {
      return {rounded(d.x_m / kUnit_m), rounded(d.y_m / kUnit_m),
              static_cast<std::int16_t>(d.yaw.turn >> (8 * sizeof(d.yaw.turn) - 16))};
    }
    [[nodiscard]] Displacement<Scalar> displacement() const {
      using Turn = typename Heading<Scalar>::Turn;
      return {static_cast<Scalar>(x) * kUnit_m,
              static_cast<Scalar>(y) * kUnit_m,
              {static_cast<Turn>(static_cast<typename Heading<Scalar>::Unsigned>(yaw) << (8 * sizeof(Turn) - 16))}};
    }
    /// The lowest value: too far for the trail.
    [[nodiscard]] bool known() const { return x != INT16_MIN && y != INT16_MIN; }

   private:
    static std::int16_t rounded(Scalar v) {
      if (!(v < Scalar{32767} && v > Scalar{-32767})) return INT16_MIN;
      return static_cast<std::int16_t>(v < Scalar{0} ? v - static_cast<Scalar>(0.5) : v + static_cast<Scalar>(0.5));
    }
  };
  static constexpr std::size_t at(int i) { return static_cast<std::size_t>(i); }
  static ClosureRecord<Scalar> record(ClosureFate fate, Scalar contradiction = -1) { return {fate, contradiction}; }
  /// A share of the places stays free for what comes during a job.
  [[nodiscard]] bool nearly_full() const {
    return graph_.poses() > kPoses - kPoses / 16 || graph_.edges() - graph_.refused() > kEdges - kEdges / 16;
  }

  [[nodiscard]] Pose local() const {
    const int last = graph_.poses() - 1;
    return step_ == id_[at(last)] ? graph_.pose(last) : graph_.pose(last).plus(pending_.mean);
  }
  [[nodiscard]] Pose placed(const Pose& in_graph) const { return origin_.plus(in_graph.minus({})); }

  [[nodiscard]] bool keyframe_due() const {
    const Scalar x = pending_.mean.x_m, y = pending_.mean.y_m, turn = pending_.mean.yaw.radians();
    const auto way = static_cast<Scalar>(options_.distance_m), angle = static_cast<Scalar>(options_.turn_rad);
    return x * x + y * y >= way * way || turn >= angle || turn <= -angle;
  }
  void make_keyframe() {
    if (graph_.edges() == kEdges) static_cast<void>(graph_.forget_refused(1));
    if (!graph_.has_room_for_pose() && !thin()) {
      ++count_.skipped;
      return;
    }
    if (!graph_.append(pending_)) {
      ++count_.skipped;
      return;
    }
    id_[at(graph_.poses() - 1)] = step_;
  }
  /// Composes that keyframe away which costs least: the gap that it leaves, times the closures that have to move and
  /// one.
  bool thin() {
    int best = -1;
    std::uint32_t least = 0xffff'ffffU;
    for (int k = 1; k + 1 < graph_.poses(); ++k) {
      const std::uint32_t cost = (id_[at(k + 1)] - id_[at(k - 1)]) * (1U + graph_.closures_of(k));
      if (cost < least) least = cost, best = k;
    }
    if (best < 0 || !graph_.compose_away(best)) return false;
    settled_ = false;
    for (int k = best; k < graph_.poses(); ++k) id_[at(k)] = id_[at(k + 1)];
    ++count_.composed_away;
    return true;
  }

  /// The keyframe at or before a step, or -1.
  [[nodiscard]] int keyframe_of(std::uint32_t step) const {
    if (step > step_) return -1;
    int k = graph_.poses() - 1;
    while (k > 0 && id_[at(k)] > step) --k;
    return k;
  }
  /// Odometry from a keyframe to a later step. Its covariance is a share of that of the next keyframe's edge.
  [[nodiscard]] bool way(int k, std::uint32_t step, Motion& way) const {
    const std::uint32_t first = id_[at(k)];
    if (step == first) return true;
    if (k == graph_.poses() - 1 && step == step_) return way = pending_, true;
    if (step_ - first >= static_cast<std::uint32_t>(kTrail)) return false;
    Pose end{};
    for (std::uint32_t s = first + 1; s <= step; ++s) {
      if (!trail_[s % kTrail].known()) return false;
      end = end.plus(trail_[s % kTrail].displacement());
    }
    const bool last = k == graph_.poses() - 1;
    const auto whole = static_cast<Scalar>(static_cast<std::int32_t>((last ? step_ : id_[at(k + 1)]) - first));
    const Scalar share = static_cast<Scalar>(static_cast<std::int32_t>(step - first)) / whole;
    way = {.mean = end.minus({}), .covariance = last ? pending_.covariance : graph_.odometry_covariance(k + 1)};
    for (int c = 0; c < 3; ++c)
      for (int r = 0; r <= c; ++r) way.covariance(r, c) *= share;
    return true;
  }
  /// A closure between two steps, moved to the keyframes before them through odometry.
  struct Link {
    int a = 0, b = 0;
    Motion z;
  };
  [[nodiscard]] bool between_keyframes(std::uint32_t i, std::uint32_t j, const Motion& z, Link& link) const {
    const int a = keyframe_of(i), b = keyframe_of(j);
    Motion to_i, to_j;
    if (a < 0 || b < 0 || i == j || !way(a, i, to_i) || !way(b, j, to_j)) return false;
    link = {.a = a, .b = b, .z = i == id_[at(a)] ? z : compose(to_i, z)};
    if (j != id_[at(b)]) link.z = compose(link.z, inverse(to_j));
    return true;
  }
  /// A job under way gives way to a closure without room, but not twice in a row, so that jobs end.
  void give_way() {
    if (gave_way_ || !graph_.busy()) return;
    cancel_job();
    gave_way_ = true;
  }
  /// After a job without room an eighth of the keyframes is composed away, which merges closures and loses none. The
  /// newest closures go when there are too few keyframes for that, or when it had no effect.
  void make_room() {
    const bool thinned = count_.composed_away != thinned_before_ || count_.jobs_without_room == 1;
    thinned_before_ = count_.composed_away;
    to_thin_ = (graph_.poses() - kLeastPoses) / 8;
    if (to_thin_ <= 0 || !thinned) {
      to_thin_ = 0;
      count_.refused += static_cast<std::uint32_t>(graph_.remove_closures(graph_.closures() / 8 + 1));
    }
    optimise();
  }
  /// A closure that is contradicted today waits among the edges, where that costs no closure its place.
  void keep_for_later(const Link& link) {
    forget_beyond(kMostRefused - 1);
    if (graph_.edges() < kEdges - kEdges / 16 && graph_.refused() < kMostRefused)
      to_judge_ += graph_.keep_refused(link.a, link.b, link.z) ? 1 : 0;
  }
  void forget_beyond(int most) {
    if (graph_.refused() > most) static_cast<void>(graph_.forget_refused(graph_.refused() - most));
  }
  /// Refused closures leave the places that what comes during a job may need.
  void keep_share_free() {
    const int over = graph_.edges() - (kEdges - kEdges / 16);
    if (over > 0) static_cast<void>(graph_.forget_refused(over));
  }
  void judge_all_again() { to_judge_ = graph_.refused(); }
  /// Looks at the next refused closure: whether it is near enough by odometry's covariance for a trial of the graph
  /// with it. One a call; false: no trial has begun.
  bool begin_trial() {
    if (to_judge_ == 0 || waiting_ > 0 || !settled_) return false;
    --to_judge_;
    int e = graph_.next_refused(next_refused_);
    if (e < 0) e = graph_.next_refused(0);
    if (e < 0) return to_judge_ = 0, false;
    next_refused_ = e + 1;
    const Scalar squared = graph_.contradiction(e);
    const auto limit = static_cast<Scalar>(options_.contradiction);
    if (!(squared >= Scalar{0} && squared < kNear * limit) || !graph_.begin_trial(e, limit)) return false;
    ++count_.trials;
    return true;
  }
  void end_trial() {
    if (!graph_.taken()) return;
    ++count_.jobs;
    ++count_.taken_later;
    judge_all_again();
  }
  void end_job() {
    gave_way_ = false;
    if (graph_.tried()) return end_trial();
    ++count_.jobs;
    settled_ = graph_.status() == GraphStatus::kConverged;
    if (settled_) {
      count_.contradicted += static_cast<std::uint32_t>(graph_.refuse_left_out());
      forget_beyond(kMostRefused);
      judge_all_again();
    } else if (graph_.status() == GraphStatus::kNoRoom) {
      ++count_.jobs_without_room;
      make_room();
    } else {
      ++count_.jobs_not_converged;
    }
  }

  KeyframeOptions options_;
  Graph graph_;
  Pose origin_{};
  Motion pending_{};
  KeyframeCounters count_;
  std::uint32_t step_ = 0;
  int waiting_ = 0;                   ///< closures since the last job began
  std::uint32_t thinned_before_ = 0;  ///< KeyframeCounters::composed_away at the last job without room
  bool gave_way_ = false;             ///< the last job did not end
  int to_thin_ = 0;                   ///< keyframes that are composed away before the next job
  bool settled_ = true;               ///< poses are at the optimum of the closures that count, but for waiting_
  int to_judge_ = 0;                  ///< refused closures that the poses of now have not been held against
  int next_refused_ = 0;              ///< place of an edge from which the next one is looked for
  std::array<std::uint32_t, kPoses> id_{};
  std::array<Step, kTrail> trail_{};
};

}  // namespace tetap::slam
