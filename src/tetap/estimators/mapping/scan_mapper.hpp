// SPDX-License-Identifier: Apache-2.0
// Graph-SLAM with a planar laser scanner and no other computer. Scan matching makes the keyframes of a pose graph. In
// ticks without a scan at work the graph is optimised, and older keyframes are matched with the newest one.
// docs/explanation/scan_matching.md and pose_graph.md have the equations.
//
// Delayed, as the odometry by scans is.
#pragma once

#include "tetap/estimators/mapping/graph_mapper.hpp"
#include "tetap/estimators/mapping/on_scan_odometry.hpp"
#include "tetap/slam/scan_closures.hpp"

namespace tetap::estimators {

/// Graph: slam::KeyframeGraph. Of each keyframe up to kKept ranges are kept, of up to kScans keyframes.
template <int kBeams, int kFrames, class Graph, int kKept, int kScans>
class ScanMapper : public OnScanOdometry<kBeams, kFrames> {
  using Odometer = ScanOdometry<kBeams, kFrames>;
  using Mapper = GraphMapper<Graph>;
  using Closures = slam::ScanClosures<kBeams, kKept, kScans>;

 public:
  static constexpr sensor::EstimatorKind kKind = Mapper::kKind;

  void restart(base::Micros t, const Context& ctx);
  /// The whole map moves rigidly, so that the robot is there.
  void set_pose(base::Micros t, const SetPose& given, const Context& ctx);
  /// Forgets keyframes, their scans and closures. The robot stays where it is.
  void reset_own_map();
  void advance(base::Micros t, const Context& ctx, const sensor::Window& window);
  /// A scan's match first, then the graph's job, then the search for closures.
  void work(std::uint32_t units, const Context& ctx);
  void abort_job();

  using OnScanOdometry<kBeams, kFrames>::fuse;
  Innovation fuse(const sensor::PlanarScan& scan, base::Micros stamp, std::uint8_t instance, const Context& ctx);
  /// A closure from elsewhere.
  Innovation fuse(const sensor::LoopClosure& closure, base::Micros stamp, const Context& ctx) {
    return mapper_.fuse(closure, stamp, ctx);
  }

  [[nodiscard]] Estimate estimate(const Context& ctx) const { return odometer_.estimate(ctx); }
  /// Degraded: the latest optimisation did not converge.
  [[nodiscard]] sensor::Mode mode(const Context& ctx) const {
    const sensor::Mode map = mapper_.mode(ctx);
    return map == sensor::Mode::kDegraded ? map : odometer_.mode(ctx);
  }
  [[nodiscard]] std::uint16_t faults() const { return mapper_.faults(); }
  [[nodiscard]] MapReport own_map() const { return mapper_.own_map(); }
  [[nodiscard]] GraphReport graph() const { return mapper_.graph(); }
  [[nodiscard]] GraphKeyframe own_keyframe(std::size_t i) const { return mapper_.own_keyframe(i); }
  template <class Sink>
  void new_keyframes(Sink&& sink) const {
    mapper_.new_keyframes(sink);
  }
  [[nodiscard]] const slam::ScanClosureCounters& closure_counters() const { return closures_.counters(); }

  /// The search for closures is not hashed: the digest stands for its scans, and the graph has what it found.
  static constexpr auto members(auto& self) {
    return base::members(self.odometer_, self.mapper_, base::unhashed(self.closures_), self.digest_);
  }
  template <class Sink>
  void hash_memory(Sink&& sink) const {
    mapper_.hash_memory(sink);
    for (std::size_t i = 0; i < Closures::elements(); ++i) closures_.hash_element(i, sink);
  }

 private:
  static constexpr std::uint32_t kGraphUnits = 5;  ///< units of the graph that cost as much as one of a match

  /// The odometry goes on from where the graph has its latest keyframe.
  void follow_graph();

  using OnScanOdometry<kBeams, kFrames>::odometer_;
  Mapper mapper_;
  Closures closures_;
  base::StateDigest digest_;
};

/// On a node of 256 kB.
using ScanMapper192 = ScanMapper<361, 4, Graph192, 181, 192>;

}  // namespace tetap::estimators
