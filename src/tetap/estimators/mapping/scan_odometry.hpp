// SPDX-License-Identifier: Apache-2.0
// Odometry from a planar laser scanner as an estimator. Each scan is matched against the latest keyframes, with wheels
// as the prior, as a job in units of work; without a match the wheels alone count. docs/explanation/scan_matching.md
// has the equations.
//
// Delayed: a scan is matched when it leaves the window. Dead reckoning carries the pose of the latest scan to the
// present.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/base/state_digest.hpp"
#include "tetap/estimators/context.hpp"
#include "tetap/estimators/estimate.hpp"
#include "tetap/estimators/own_map.hpp"
#include "tetap/estimators/planar/dead_reckoning.hpp"
#include "tetap/sensor/window.hpp"
#include "tetap/slam/scan_match.hpp"

#include <cstdint>
#include <utility>

namespace tetap::estimators {

template <int kBeams, int kFrames>
class ScanOdometry {
  using Match = slam::ScanMatch<kBeams, kFrames>;

 public:
  using Pose = slam::GraphPose<float>;
  using Step = slam::UncertainDisplacement<float>;
  static constexpr sensor::EstimatorKind kKind = sensor::EstimatorKind::kScanOdometry;
  static constexpr bool kDelayed = true;
  static constexpr int kMostBeams = kBeams;

  /// Without a start pose the robot begins at the origin.
  void restart(base::Micros t, const Context& ctx);
  /// The keyframes are forgotten: the next scan is the first one there.
  void set_pose(base::Micros t, const SetPose& given, const Context& ctx);
  void advance(base::Micros t, const Context& ctx, const sensor::Window& window);
  void work(std::uint32_t units, const Context& ctx);
  void abort_job();
  /// A scan waits for the job of the one before it.
  [[nodiscard]] bool defers(const sensor::Sample& sample, const Context&) const {
    return sample.sensor == sensor::Sensor::kScan && match_.busy();
  }

  template <class Input>
  requires requires(DeadReckoning& motion, const Input& input, const param::Parameters& n) {
    motion.fuse(input, base::Micros{}, n);
  }
  Innovation fuse(const Input& input, base::Micros stamp, const Context& ctx) {
    return input_record(motion_.fuse(input, stamp, ctx.parameters));
  }
  /// Pending: the record comes when the match has ended. One with more beams than fit is refused.
  Innovation fuse(const sensor::PlanarScan& scan, base::Micros stamp, std::uint8_t instance, const Context& ctx);
  template <class Sink>
  void late_records(Sink&& sink) {
    if (recorded_) sink(record_);
    recorded_ = false;
  }
  static void close_batch(const Context&) {}

  [[nodiscard]] Estimate estimate(const Context& ctx) const;
  [[nodiscard]] MotionVariance motion_variance(const Context& ctx) const {
    return present_.motion_variance(ctx.parameters);
  }
  /// Dead reckoning: no scan was matched for two seconds.
  [[nodiscard]] sensor::Mode mode(const Context&) const {
    const bool lately = matched_ && now_ - last_match_ <= base::Micros{2'000'000};
    return lately ? sensor::Mode::kNominal : sensor::Mode::kDeadReckoning;
  }
  [[nodiscard]] ScanMatchReport scan_match() const { return report_; }
  [[nodiscard]] const slam::ScanMatchCounters& counters() const { return match_.counters(); }

  /// For a map on top of the odometry: a keyframe is new since the last call.
  [[nodiscard]] bool take_new_keyframe() { return std::exchange(new_keyframe_, false); }
  /// The body's displacement that led to the newest keyframe, and its time.
  [[nodiscard]] const Step& keyframe_step() const { return keyframe_step_; }
  [[nodiscard]] base::Micros keyframe_stamp() const { return record_.stamp; }
  /// Points of the newest keyframe while it is new.
  [[nodiscard]] const slam::Scan<kBeams>& keyframe_scan() const { return match_.scan(); }
  [[nodiscard]] bool busy() const { return match_.busy(); }
  /// The body at the scan that was fused last, in the odometry's own frame.
  [[nodiscard]] Pose scan_pose() const { return reference_.plus(step_.mean); }
  /// Motion of the scanner at the scan that was fused last, in its own axes.
  [[nodiscard]] const slam::ScanMotion& scanner_motion() const { return scanner_motion_; }
  /// The body from the newest keyframe to the far end of the window.
  [[nodiscard]] slam::Displacement<float> since_keyframe(base::Micros t, const Context& ctx);
  /// The newest keyframe, all others and the robot with it, is there; p is its covariance.
  void move_keyframe(const Pose& pose, const filter::Symmetric<float, 3>& p);

  /// The keyframes and the job are not hashed: the digest stands for them, by what each match found.
  static constexpr auto members(auto& self) {
    return base::members(base::unhashed(self.match_), base::unhashed(self.keyframes_), self.motion_,
                         base::unhashed(self.present_), self.reference_, self.reference_p_,
                         base::in_turns(self.odometry_), base::in_turns(self.step_), base::unhashed(self.scan_),
                         base::unhashed(self.record_), base::unhashed(self.report_), self.now_, self.last_match_,
                         self.matched_, self.recorded_, self.new_keyframe_, base::in_turns(self.scanner_motion_),
                         base::in_turns(self.keyframe_step_), self.digest_);
  }

 private:
  [[nodiscard]] static Step displaced(const Estimate& estimate);
  /// The robot, now at this pose with this covariance.
  void place(base::Micros t, const model::PlanarPose& pose, const filter::Symmetric<float, 3>& p);
  void conclude(const Context& ctx);
  void make_keyframe(const Context& ctx);
  void record(sensor::Verdict verdict, sensor::Check failed);

  Match match_;
  typename Match::Keyframes keyframes_;  ///< poses of the scanner
  DeadReckoning motion_;                 ///< at the far end of the window: from the latest scan
  DeadReckoning present_;                ///< the same carried over the window
  Pose reference_;                       ///< pose of the body at the newest keyframe, or at the start
  filter::Symmetric<float, 3> reference_p_;
  Step odometry_;  ///< displacement of the body from the reference to the latest scan, by wheels alone
  Step step_;      ///< the same by the scans
  sensor::PlanarScan scan_;
  LateRecord record_;
  ScanMatchReport report_;
  base::Micros now_;
  base::Micros last_match_;
  bool matched_ = false, recorded_ = false, new_keyframe_ = false;
  slam::ScanMotion scanner_motion_;
  Step keyframe_step_;
  base::StateDigest digest_;
};

using ScanOdometry361 = ScanOdometry<361, 4>;

}  // namespace tetap::estimators
