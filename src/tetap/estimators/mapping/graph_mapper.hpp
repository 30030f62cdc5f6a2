// SPDX-License-Identifier: Apache-2.0
// A pose graph as an estimator (graph-SLAM). Odometry makes keyframes, and displacements between them (In_Closure)
// close loops. Relinearisation is a job in units of work. docs/explanation/pose_graph.md has the equations and what is
// defined when.
//
// Delayed: the graph is at the far end of the window. Dead reckoning carries its pose to the present.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/base/state_digest.hpp"
#include "tetap/estimators/context.hpp"
#include "tetap/estimators/estimate.hpp"
#include "tetap/estimators/own_map.hpp"
#include "tetap/estimators/planar/dead_reckoning.hpp"
#include "tetap/sensor/window.hpp"
#include "tetap/slam/keyframe_graph.hpp"

#include <array>
#include <cstddef>
#include <cstdint>

namespace tetap::estimators {

/// Graph: slam::KeyframeGraph.
template <class Graph>
class GraphMapper {
  using Scalar = typename Graph::Scalar;
  using Pose = typename Graph::Pose;
  using Displaced = typename Graph::Motion;

 public:
  static constexpr sensor::EstimatorKind kKind = sensor::EstimatorKind::kPoseGraph;
  static constexpr bool kDelayed = true;
  /// Poses and edges whose memory enters the digest in one tick.
  static constexpr std::size_t kScanned = 8;
  /// New keyframes of one tick that are announced; those beyond are not.
  static constexpr std::size_t kAnnounced = 32;

  /// Without a start pose the first keyframe is the origin of the map.
  void restart(base::Micros t, const Context& ctx);
  /// The whole graph moves rigidly, so that the robot is there. A job under way is given up and begun anew.
  void set_pose(base::Micros t, const SetPose& given, const Context& ctx);
  /// Forgets keyframes and closures. The robot stays where it is: the first keyframe of the next graph.
  void reset_own_map();
  void advance(base::Micros t, const Context& ctx, const sensor::Window& window);
  void work(std::uint32_t units, const Context& ctx);
  void abort_job() { graph_.cancel_job(); }
  [[nodiscard]] bool idle() const { return graph_.idle(); }

  template <class Input>
  requires requires(DeadReckoning& motion, const Input& input, const param::Parameters& n) {
    motion.fuse(input, base::Micros{}, n);
  }
  Innovation fuse(const Input& input, base::Micros stamp, const Context& ctx) {
    const sensor::Verdict verdict = motion_.fuse(input, stamp, ctx.parameters);
    if (ctx.parameters.mapping.keyframes == kByWheels && keyframe_due(stamp, ctx)) make_keyframe(stamp);
    return input_record(verdict);
  }
  Innovation fuse(const sensor::LoopClosure& closure, base::Micros stamp, const Context& ctx);

  [[nodiscard]] Estimate estimate(const Context& ctx) const;
  [[nodiscard]] MotionVariance motion_variance(const Context& ctx) const {
    return present_.motion_variance(ctx.parameters);
  }
  /// Degraded: the latest optimisation did not converge.
  [[nodiscard]] sensor::Mode mode(const Context& ctx) const;
  /// Capacity, for a second after a closure found no room.
  [[nodiscard]] std::uint16_t faults() const {
    const bool full = refused_ > 0 && now_ - last_refused_ < base::Micros{1'000'000};
    return full ? std::uint16_t{1U << static_cast<unsigned>(sensor::Fault::kCapacity)} : std::uint16_t{0};
  }

  [[nodiscard]] MapReport own_map() const;
  [[nodiscard]] GraphReport graph() const;
  [[nodiscard]] GraphKeyframe own_keyframe(std::size_t i) const;
  template <class Sink>
  void new_keyframes(Sink&& sink) const {
    for (std::size_t i = announced_; i > 0; --i) {
      const Announcement& one = announcement_[(next_announcement_ + kAnnounced - i) % kAnnounced];
      if (one.tick != before_) continue;
      NewKeyframe keyframe{.id = one.id, .stamp = one.stamp, .step_x_m = base::kNan, .step_y_m = base::kNan};
      slam::Displacement<Scalar> step;
      if (graph_.trail(one.id, step)) {
        keyframe.step_x_m = static_cast<float>(step.x_m);
        keyframe.step_y_m = static_cast<float>(step.y_m);
      }
      sink(keyframe);
    }
  }

  /// For an odometer of its own, which makes the keyframes and carries the pose: a displacement from the last keyframe
  /// to the next. False when it is no number or no covariance.
  bool step(const Displaced& displacement, base::Micros stamp);
  /// Without wheels and without the present.
  void advance(base::Micros t);
  /// Pose and covariance of the latest step in the map. Implements docs/explanation/pose_graph.md (8).
  [[nodiscard]] Pose step_pose() const { return graph_.pose(); }
  [[nodiscard]] filter::Symmetric<Scalar, 3> covariance() const;
  /// For closures that it finds itself.
  [[nodiscard]] Graph& keyframes() { return graph_; }

  /// All but the graph, which digest() stands for.
  static constexpr auto members(auto& self) {
    return base::members(base::unhashed(self.graph_), self.motion_, base::unhashed(self.present_),
                         base::in_turns(self.placed_), base::in_turns(self.placed_pose_), base::in_turns(self.since_),
                         base::in_turns(self.graph_then_), self.placed_at_, self.stepped_, self.last_closure_,
                         self.last_refused_, self.now_, self.before_, self.refused_, self.jobs_,
                         base::in_turns(self.announcement_), base::count(self.announced_),
                         base::count(self.next_announcement_), self.digest_);
  }
  [[nodiscard]] std::uint32_t digest() const { return digest_.value(); }
  /// All poses and edges, for a comparison of whole states.
  template <class Sink>
  void hash_memory(Sink&& sink) const {
    for (std::size_t i = 0; i < elements(); ++i) hash_element(i, sink);
  }

 private:
  static constexpr std::int32_t kByWheels = 0;
  static constexpr std::uint32_t kMapReset = 0x4D41'5052;  ///< a word of its own in the digest
  static constexpr std::uint32_t kIds = 0x4000;            ///< identities on the bus go round

  [[nodiscard]] bool keyframe_due(base::Micros stamp, const Context& ctx) const;
  void make_keyframe(base::Micros stamp);
  [[nodiscard]] bool append(const Displaced& step, base::Micros stamp);
  /// The displacement with its covariance; of a singular one the covariance is not positive definite.
  [[nodiscard]] static Displaced displaced(const sensor::LoopClosure& closure);
  [[nodiscard]] static Displaced displaced(const DeadReckoning& motion);
  /// The latest step of this identity; above step(): none.
  [[nodiscard]] std::uint32_t step_of(std::uint32_t id) const {
    return graph_.step() - ((graph_.step() - id) & (kIds - 1));
  }
  [[nodiscard]] Innovation odometry(const sensor::LoopClosure& closure, base::Micros stamp);
  /// The robot, now at this pose with this covariance; nothing else of the graph changes.
  void place(base::Micros t, const model::PlanarPose& pose, const filter::Symmetric<float, 3>& p);
  void note_refused();

  [[nodiscard]] std::size_t elements() const {
    return static_cast<std::size_t>(graph_.graph().poses()) + static_cast<std::size_t>(graph_.graph().edges());
  }
  template <class Sink>
  void hash_element(std::size_t i, Sink& sink) const {
    const auto poses = static_cast<std::size_t>(graph_.graph().poses());
    if (i < poses) return hash_pose(graph_.graph().pose(static_cast<int>(i)), sink);
    const auto& edge = graph_.graph().edge(static_cast<int>(i - poses));
    sink(static_cast<std::uint32_t>(edge.from) | static_cast<std::uint32_t>(edge.to) << 14 |
         static_cast<std::uint32_t>(edge.closure) << 28 | static_cast<std::uint32_t>(edge.left_out) << 29 |
         static_cast<std::uint32_t>(edge.refused) << 30);
    for (const Scalar value : {edge.z.x_m, edge.z.y_m, edge.z.yaw.radians()}) sink(static_cast<float>(value));
    for (const Scalar value : edge.whitening) sink(static_cast<float>(value));
  }
  template <class Sink>
  static void hash_pose(const Pose& pose, Sink& sink) {
    for (const auto& coordinate : {pose.x, pose.y}) {
      sink(coordinate.unit);
      sink(static_cast<float>(coordinate.rest_m));
    }
    sink(static_cast<float>(pose.yaw.radians()));
  }

  struct Announcement {
    std::uint32_t id = 0;
    base::Micros stamp, tick;  ///< tick: the one before the announcement
  };

  Graph graph_;
  DeadReckoning motion_;   ///< at the far end of the window: from the latest step
  DeadReckoning present_;  ///< the same carried over the window
  /// From the pose that a command or the start states: its covariance, and that of the odometry since.
  filter::Symmetric<Scalar, 3> placed_;
  Pose placed_pose_;
  filter::Symmetric<Scalar, 3> since_;       ///< covariance of the odometry since, beside placed_pose_
  filter::Symmetric<Scalar, 3> graph_then_;  ///< covariance of the graph at that time
  base::Micros placed_at_;
  base::Micros stepped_;  ///< stamp of the latest step
  base::Micros last_closure_, last_refused_;
  base::Micros now_, before_;  ///< this tick and the one before it
  std::uint32_t refused_ = 0;  ///< closures without room
  std::uint32_t jobs_ = 0;
  std::array<Announcement, kAnnounced> announcement_{};
  std::size_t announced_ = 0, next_announcement_ = 0;
  base::StateDigest digest_;
};

/// Robots of the host, of the 128 kB and of the 64 kB class.
using Graph4096 = slam::KeyframeGraph<double, 4096, 8192, 32768, 4096>;
using Graph256 = slam::KeyframeGraph<float, 256, 560, 1312, 3584>;
using Graph128 = slam::KeyframeGraph<float, 128, 288, 576, 1024>;
/// Beside a scanner, in the 256 kB class.
using Graph192 = slam::KeyframeGraph<float, 192, 448, 1312, 2048>;
using GraphMapper4096 = GraphMapper<Graph4096>;
using GraphMapper256 = GraphMapper<Graph256>;
using GraphMapper128 = GraphMapper<Graph128>;

}  // namespace tetap::estimators
