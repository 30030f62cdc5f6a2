// SPDX-License-Identifier: Apache-2.0
// The planar pose by a Kalman filter: dead reckoning corrected by known landmarks and GNSS. It has a gate, and a rule
// for getting back in when everything is refused. The kind of filter is a type: extended, unscented, or its square
// root.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/checks/persistence.hpp"
#include "tetap/estimators/context.hpp"
#include "tetap/estimators/planar/dead_reckoning.hpp"
#include "tetap/estimators/planar/gnss_alignment.hpp"
#include "tetap/estimators/planar/landmark_alignment.hpp"
#include "tetap/estimators/planar/motion_vote.hpp"
#include "tetap/estimators/planar/relocalisation.hpp"
#include "tetap/estimators/planar/turn_check.hpp"
#include "tetap/model/bearing.hpp"
#include "tetap/model/gnss_position.hpp"
#include "tetap/model/range.hpp"
#include "tetap/model/range_bearing.hpp"

#include <array>
#include <concepts>
#include <optional>

namespace tetap::estimators {

/// Filter: filter::Ekf, Ukf or UkfSqrt of model::PlanarPose.
template <class Filter>
class PoseFilter {
  using Motion = PlanarDeadReckoning<Filter>;

 public:
  /// The mean of an unscented filter depends on the spread of its points, that of an extended one does not.
  static constexpr bool kUnscented = !std::derived_from<Filter, PlanarEkf>;
  static constexpr sensor::EstimatorKind kKind = kUnscented ? sensor::EstimatorKind::kUkf : sensor::EstimatorKind::kEkf;

  static constexpr bool kUsesMap = true;
  static constexpr bool kTakesRelatives = requires(Filter & filter) { filter.clones; };

  void restart(base::Micros t, const Context& ctx) {
    clear();
    if (ctx.parameters.start.known != 0) {
      set_pose(t, start_pose(ctx.parameters.start), ctx);
    } else {
      motion_.start(t, model::PlanarPose{}, kUnknown_m, kFreeHeading_rad);
    }
  }
  void set_pose(base::Micros t, const SetPose& given, const Context& ctx) {
    motion_.propagate(t, ctx.parameters);
    const bool heading = given.sigma_yaw_rad < 3.14F;  // false for NaN too
    motion_.start(t, given.pose, given.sigma_position_m, heading ? given.sigma_yaw_rad : kFreeHeading_rad);
    phase_ = heading ? Phase::kTracking : Phase::kWaiting;
    alignment_ = {};
    landmarks_.reset();
    relocalisation_.reset();
    last_absolute_ = t;
    last_fused_fix_ = {};  // no fix has a part in the pose
    refused_ = {};
    in_a_row_ = {};
    trust_motion();
    forget_clones();
  }

  void advance(base::Micros t, const Context&) { motion_.advance(t), now_ = t; }

  template <class Input>
  requires requires(Motion& motion, const Input& input, const param::Parameters& n) {
    motion.fuse(input, base::Micros{}, n);
  }
  Innovation fuse(const Input& input, base::Micros stamp, const Context& ctx) {
    const sensor::Verdict verdict = motion_.fuse(input, stamp, ctx.parameters);
    if (!std::same_as<Input, sensor::ImuSample> && verdict == sensor::Verdict::kAccepted)
      judge_motion(stamp, ctx.parameters);
    return input_record(verdict);
  }

  /// A sighting without identity, while tracking, is that of the landmark that it fits best (nearest neighbour).
  Innovation fuse(const sensor::LandmarkSighting& sighting, base::Micros stamp, const Context& ctx);
  Innovation fuse(const sensor::GnssPosition& fix, base::Micros stamp, const Context& ctx);
  /// Not used, and failed by its time, where the pose of its earlier stamp is not held: it began neither where an
  /// earlier one ended nor where one began that was used.
  Innovation fuse(const sensor::RelativePose& displacement, base::Micros stamp,
                  const Context& ctx) requires kTakesRelatives {
    return fuse_relative(displacement, stamp, ctx);
  }

  [[nodiscard]] Estimate estimate(const Context& ctx) const {
    Estimate estimate = motion_.estimate(ctx.parameters);
    estimate.position_valid = estimate.heading_valid = phase_ == Phase::kTracking;
    if (phase_ == Phase::kTracking) return estimate;
    const bool own_frame = landmarks_.searches();
    const float place_m2 = own_frame ? kUnknown_m * kUnknown_m : 0.0F;
    const float yaw_rad2 = own_frame || kUnscented ? kUnknown_rad * kUnknown_rad : 0.0F;
    estimate.p.add_diagonal({place_m2, place_m2, yaw_rad2});
    return estimate;
  }
  [[nodiscard]] MotionVariance motion_variance(const Context& ctx) const {
    return motion_.motion_variance(ctx.parameters);
  }
  /// Bits of sensor::Fault: each cause of the mode Degraded has one, and wheels that are refuted have one in any mode.
  [[nodiscard]] std::uint16_t faults() const {
    std::uint16_t bits = turn_.faults();
    if (phase_ != Phase::kTracking) return bits;
    if (moves_otherwise()) bits |= 1U << static_cast<unsigned>(sensor::Fault::kWheelSlip);
    if (refuses()) bits |= 1U << static_cast<unsigned>(sensor::Fault::kRejecting);
    return bits;
  }
  /// Last step to a pose that landmarks showed where the filter tracked another one.
  [[nodiscard]] Jump jump() const { return {.count = jumps_}; }
  [[nodiscard]] sensor::Mode mode(const Context&) const {
    if (phase_ == Phase::kWaiting) return sensor::Mode::kWaitingForPose;
    if (phase_ == Phase::kAligning) return sensor::Mode::kAligning;
    if (refuses() || moves_otherwise()) return sensor::Mode::kDegraded;
    return now_ - last_absolute_ > base::Micros{5'000'000} ? sensor::Mode::kDeadReckoning : sensor::Mode::kNominal;
  }
  static constexpr auto members(auto& self) {
    return base::members(self.motion_, base::in_turns(self.alignment_), base::in_turns(self.landmarks_),
                         self.relocalisation_, self.turn_, self.phase_, base::in_turns(self.refused_), self.in_a_row_,
                         self.vote_, self.last_absolute_, self.last_fused_fix_, base::unhashed(self.now_), self.jumps_);
  }

 private:
  /// A kind of source is refused again and again.
  [[nodiscard]] bool refuses() const {
    for (const std::uint8_t in_a_row : in_a_row_)
      if (in_a_row >= kDegraded) return true;
    return false;
  }
  /// The wheels' motion is not that of the gyroscope, or not that of two other devices.
  [[nodiscard]] bool moves_otherwise() const { return turn_.residual.contradicts() || vote_.contradicts(now_); }

  /// A function of its own: the empty filter leaves the stack before a pose is set.
  [[gnu::noinline]] void clear() { *this = {}; }

  enum class Phase : std::uint8_t { kWaiting, kAligning, kTracking };
  using Source = MotionVote::Source;
  static constexpr Source kLandmark = MotionVote::kLandmark, kGnss = MotionVote::kGnss;
  static constexpr float kLost_rad = 1;
  static constexpr std::uint8_t kDegraded = 3;  ///< rejections in a row
  /// 1 sigma of the heading before it is known. The mean of an unscented filter would hardly move with a heading that
  /// could be anything. An unscented filter counts in a frame of its own, where its heading is known.
  static constexpr float kFreeHeading_rad = kUnscented ? 0.0F : kUnknown_rad;

  /// A heading that could be anything is looked for afresh: a filter that linearises about it would never find it.
  void give_up_when_lost() {
    if (phase_ != Phase::kTracking || !(covariance_of(motion_.filter)(2, 2) > kLost_rad * kLost_rad)) return;
    phase_ = Phase::kWaiting;
    alignment_ = {};
    landmarks_.reset();
    relocalisation_.reset();
    forget_clones();
    if (kUnscented) motion_.forget_heading();
  }
  template <class Model>
  Innovation measure(const Model& model, Source source, float gate_scale, base::Micros stamp, const Context& ctx,
                     std::uint8_t landmark = 0xFF, bool named = false);
  template <class Model>
  auto update_by(const Model& model, float gate, base::Micros stamp, const param::GnssParameters& n)
      -> filter::Innovation<float, Model::kDimension>;
  /// The filter goes to the pose that the search found.
  void take_rival(base::Micros stamp);
  Innovation fuse_relative(const sensor::RelativePose& displacement, base::Micros stamp, const Context& ctx);
  /// Identity of the landmark that the sighting fits best; that of any where the pose is not known.
  [[nodiscard]] std::uint8_t nearest_landmark(const sensor::LandmarkSighting& sighting, const Context& ctx) const;
  /// A sighting while the pose is unknown.
  Innovation align(const model::RangeBearing& seen, base::Micros stamp, const Context& ctx, std::uint8_t landmark);
  /// The pose is another one now, without a relation to earlier ones.
  void forget_clones() {
    if constexpr (kTakesRelatives) motion_.filter.clones.forget();
  }
  void begin_tracking(base::Micros stamp) {
    phase_ = Phase::kTracking;
    landmarks_.reset();
    vote_.reset();
    last_absolute_ = stamp;
    last_fused_fix_ = {};  // a start by fixes notes its own
  }
  void recover(checks::Persistence& refused, base::Micros stamp, const param::RecoveryParameters& n);
  /// Wheels against the gyroscope, and what an earlier vote left of the trust in wheels.
  void judge_motion(base::Micros stamp, const param::Parameters& n);
  /// Landmarks and fixes both contradict the filter: the motion is wrong, by the innovation since the last agreement.
  [[nodiscard]] bool both_refuse(Source source, base::Micros stamp) const;
  /// Makes the pose less certain between two measurements, for another reason than the way's own errors.
  void widen(const std::array<float, 3>& variance) {
    add_variance(motion_.filter, variance);
    relocalisation_.ignore(variance);
  }
  void widen_by_vote(float place_m2, float yaw_rad2, base::Micros stamp);
  void trust_motion() {
    vote_.reset();
    turn_.residual.reset();
  }

  Motion motion_;
  GnssAlignment alignment_;
  LandmarkAlignment landmarks_;
  Relocalisation relocalisation_;
  TurnCheck turn_;
  Phase phase_ = Phase::kWaiting;
  std::array<checks::Persistence, MotionVote::kSources> refused_{};  ///< rejections in a row of one kind of sensor
  std::array<std::uint8_t, MotionVote::kSources> in_a_row_{};        ///< the same, which a widening does not end
  MotionVote vote_;
  base::Micros last_absolute_;   ///< stamp of the last accepted landmark or fix
  base::Micros last_fused_fix_;  ///< stamp of the last fix that has a part in the pose; 0: none
  base::Micros now_;             ///< unhashed: of the last tick, set anew by the next
  std::uint8_t jumps_ = 0;       ///< relocalisations since the start
};

}  // namespace tetap::estimators
