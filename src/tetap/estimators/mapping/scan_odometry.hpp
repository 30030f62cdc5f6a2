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

namespace tetap::estimators {

template <int kBeams, int kFrames>
class ScanOdometry {
  using Match = slam::ScanMatch<kBeams, kFrames>;
  using Pose = slam::GraphPose<float>;
  using Step = slam::UncertainDisplacement<float>;

 public:
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

  /// The keyframes and the job are not hashed: the digest stands for them, by what each match found.
  static constexpr auto members(auto& self) {
    return base::members(base::unhashed(self.match_), base::unhashed(self.keyframes_), self.motion_,
                         base::unhashed(self.present_), self.reference_, self.reference_p_,
                         base::in_turns(self.odometry_), base::in_turns(self.step_), base::unhashed(self.scan_),
                         base::unhashed(self.record_), base::unhashed(self.report_), self.now_, self.last_match_,
                         self.matched_, self.recorded_, self.digest_);
  }

 private:
  /// The scanner on the body.
  [[nodiscard]] static Step mounting(const Context& ctx);
  /// A displacement of the body as one of the scanner, and back.
  [[nodiscard]] static Step of_scanner(const Step& body, const Step& mounting) {
    return compose(compose(inverse(mounting), body), mounting);
  }
  [[nodiscard]] static Step of_body(const Step& scanner, const Step& mounting) {
    return compose(compose(mounting, scanner), inverse(mounting));
  }
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
  bool matched_ = false, recorded_ = false;
  base::StateDigest digest_;
};

using ScanOdometry361 = ScanOdometry<361, 4>;

}  // namespace tetap::estimators
