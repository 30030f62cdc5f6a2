// SPDX-License-Identifier: Apache-2.0
// GNSS position, horizontal: when a fix is fused, and when fixes that were refused become true. A fix is judged by the
// receiver's own accuracy. A fix that would decide where the filter is has to be confirmed by others; fixes that are
// refused count only by persisting (checks/offset_hypothesis.hpp).
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/checks/chi_square.hpp"
#include "tetap/checks/coloured_noise.hpp"
#include "tetap/checks/frozen_position.hpp"
#include "tetap/checks/offset_hypothesis.hpp"
#include "tetap/checks/startup_fix_check.hpp"
#include "tetap/estimators/inertial/filter_view.hpp"
#include "tetap/estimators/inertial/fix_measurement.hpp"
#include "tetap/estimators/inertial/recovery.hpp"
#include "tetap/estimators/inertial/refusal.hpp"
#include "tetap/model/gnss_fix_3d.hpp"

#include <array>
#include <optional>

namespace tetap::estimators {

class GnssPositionSource {
 public:
  using Measurement = FixMeasurement;
  /// In the robot's map; none while the receiver has no fix or the map no origin. The second: a fix outside of the map.
  struct Converted {
    std::optional<model::GnssFix3d> fix;
    bool outside = false;
  };
  /// height_m: what stands for a height that is not there, above the origin's level surface.
  [[nodiscard]] static Converted convert(const sensor::GnssPosition& fix, float height_m, const Context& ctx);

  /// Before the filter runs: whether the fix may start it.
  [[nodiscard]] bool starting_conditions(const sensor::GnssPosition& fix, base::Micros stamp,
                                         const param::RecoveryParameters& n) {
    const bool starts = startup_.update(fix, stamp, n.confirm_fixes);
    status_.confirming();
    if (starts) last_fused_ = stamp;
    return starts;
  }
  /// The fix is news: the receiver does not repeat itself.
  [[nodiscard]] bool continuing_conditions(const sensor::GnssPosition& fix, const model::GnssFix3d& at,
                                           const FilterView& filter) {
    const bool frozen = frozen_.update(fix, nav::difference(at.x, filter.x().x), nav::difference(at.y, filter.x().y),
                                       filter.parameters().recovery.frozen_m);
    if (frozen) status_.distrusted(Check::kFrozen);
    return !frozen;
  }
  /// The joint gate; where it fails, that of the horizontal part alone.
  [[nodiscard]] Assessment assess(const FixMeasurement& z, const FilterView& filter);
  /// Factor of the variance of a fix whose error lasts since the fix before.
  [[nodiscard]] float correlated_inflation(const FilterView& filter) const {
    const float correlation_s = filter.parameters().gnss.correlation_s;
    if (!(correlation_s > 0.0F)) return 1.0F;
    return checks::kColouredNoiseInflation *
           checks::repeated(base::seconds(filter.stamp() - last_fused_), correlation_s);
  }
  /// A fix was fused, and moved the filter by so much.
  void fused(base::Micros stamp, float moved_east_m, float moved_north_m) {
    last_fused_ = stamp;
    pulled_m_ = {0.9F * pulled_m_[0] + moved_east_m, 0.9F * pulled_m_[1] + moved_north_m};
    pull_inflated_ = false;
    status_.fused();
  }
  /// The filter is elsewhere now: refusals so far were by where it was.
  void relocated(base::Micros time) {
    last_fused_ = time;
    record_.reset_refusals();
  }
  /// A pose from outside ends every offset hypothesis.
  void reset() {
    offset_.reset();
    leapt_ = false;
    record_.begin();  // the next fix is compared with none before the pose
  }
  void begin() { record_.begin(); }
  /// Vote on a velocity that is off by nu since then.
  [[nodiscard]] Vote vote(base::Micros since, const nav::Vector3& nu_mps, base::Micros stamp) const {
    const Vote present = record_.presence(since, stamp);
    if (present != Vote::kAbstains) return present;
    return vote_of_fix(innovation_, record_.refused().holds(), nu_mps,
                       base::seconds(record_.last_measurement() - since));
  }

  /// Fixes leapt by an offset that stays.
  [[nodiscard]] bool leapt() const { return leapt_; }
  [[nodiscard]] bool frozen() const { return frozen_.frozen(); }
  [[nodiscard]] const checks::Persistence& refused() const { return record_.refused(); }
  [[nodiscard]] base::Micros last_fused() const { return last_fused_; }
  /// No fix was fused for three seconds: dead reckoning.
  [[nodiscard]] bool timed_out(base::Micros at) const {
    return checks::older(last_fused_, at, base::Micros{3'000'000});
  }
  /// A fix was fused within three seconds.
  [[nodiscard]] bool fused_lately(base::Micros at) const {
    return checks::recent(last_fused_, at, base::Micros{3'000'000});
  }
  [[nodiscard]] SourceStatus status(base::Micros at) const {
    return status_.state == SourceState::kFusing && timed_out(at) ? SourceStatus{} : status_;
  }
  static constexpr auto members(auto& self) {
    return base::members(self.startup_, self.offset_, self.record_, self.innovation_, self.last_fused_, self.frozen_,
                         self.pulled_m_, self.pull_inflated_, self.leapt_, self.status_);
  }

 private:
  void confirm(Assessment& a, const param::RecoveryParameters& n);
  void judge_refused(const FixMeasurement& z, const FilterView& filter, Assessment& a);
  [[nodiscard]] bool reset_allowed(const FixMeasurement& z, const FilterView& filter, Assessment& a) const;
  [[nodiscard]] bool filter_wrong(const FilterView& filter) const;
  [[nodiscard]] bool undoes_reset(const FixMeasurement& z, const FilterView& filter) const;
  [[nodiscard]] bool lost(const FilterView& filter) const;
  [[nodiscard]] bool leaps(const FixMeasurement& z, const FilterView& filter) const;

  checks::StartupFixCheck startup_;
  checks::OffsetHypothesis offset_;  ///< offset of fixes that were not fused
  DeviceRecord record_;
  LevelInnovation innovation_;  ///< innovation of the last fix
  base::Micros last_fused_;     ///< stamp of the last fix that was fused, or of the last reset; 0: none
  checks::FrozenPosition frozen_;
  std::array<float, 2> pulled_m_{};  ///< by how much the last fixes moved the position
  bool pull_inflated_ = false;       ///< the position is already less certain by that
  bool leapt_ = false;               ///< fixes are refused since one leapt, all by the same offset
  SourceStatus status_;
};

inline GnssPositionSource::Converted GnssPositionSource::convert(const sensor::GnssPosition& fix, float height_m,
                                                                 const Context& ctx) {
  const param::GnssParameters& n = ctx.parameters.gnss;
  if (fix.fix < sensor::GnssFix::k2d || ctx.map_frame.origin == sensor::OriginSource::kNone) return {};
  const bool has_height = base::is_finite(fix.height_m);
  const nav::Local local = ctx.map_frame.frame.to_local(
      fix.latitude_2ndeg, fix.longitude_2ndeg, has_height ? fix.height_m : ctx.map_frame.frame.height_m() + height_m);
  if (!local.valid) return {.outside = true};
  const auto sigma = [&n](float own, float otherwise) {
    const float scaled = base::is_finite(own) ? n.sigma_scale * own : otherwise;
    return scaled > n.sigma_floor_m ? scaled : n.sigma_floor_m;
  };
  return {.fix = model::GnssFix3d{
              .x = base::Anchored::from_um(local.east_um),
              .y = base::Anchored::from_um(local.north_um),
              .z = base::Anchored::from_um(local.up_um),
              .sigma_horizontal_m = sigma(fix.horizontal_acc_m, 10.0F),
              .sigma_vertical_m = has_height ? sigma(fix.vertical_acc_m, 20.0F) : FixMeasurement::kNoHeight_m,
              .antenna_b_m = {n.antenna_x_b_m, n.antenna_y_b_m, n.antenna_z_b_m}}};
}

inline Assessment GnssPositionSource::assess(const FixMeasurement& z, const FilterView& filter) {
  const param::Parameters& n = filter.parameters();
  Assessment a{.dof = 3, .nis = z.statistics.joint_nis, .gate = fix_gate(n.gnss, 3)};
  const bool agrees = a.nis <= a.gate || z.statistics.horizontal_nis <= fix_gate(n.gnss, 2);
  if (!agrees) a.failed = Check::kGate;
  leapt_ = !agrees && (leapt_ || leaps(z, filter));
  record_.update(!agrees, filter.stamp());
  const std::array<float, 2>& expected_m2 = z.statistics.expected_m2;
  innovation_ = {z.nu(0), z.nu(1), 0.5F * (expected_m2[0] + expected_m2[1]) + z.r(0)};
  const float p_level = filter.p()(0, 0) + filter.p()(1, 1);
  if (!agrees && filter_wrong(filter)) {
    a.failed = Check::kNone;
    widen_by_innovation(a, Action::kWidenPosition, {z.nu(0), z.nu(1), 0.0F}, record_, filter.stamp());
  } else if (!agrees) {
    judge_refused(z, filter, a);
  } else if (!filter.recovery().widened_lately(filter.stamp()) && p_level > 2.0F * FixMeasurement::kDecides * z.r(0)) {
    offset_.update(filter.stamp(), z.nu(0), z.nu(1), z.r(0), p_level);
    confirm(a, n.recovery);
  }
  if (a.fuses()) offset_.reset();
  return a;
}

/// Between two fixes the filter moves as the IMU feels, but for the error of its velocity, which the receiver's own
/// velocity shows. A leap beyond is the receiver's.
inline bool GnssPositionSource::leaps(const FixMeasurement& z, const FilterView& filter) const {
  if (!filter.velocity_recent() || filter.recovery().widened_lately(filter.stamp())) return false;
  const nav::Ins::Covariance& p = filter.p();
  constexpr int kEast = nav::InsState::kVelocity, kNorth = nav::InsState::kVelocityNorth;
  const float dt_s = base::seconds(filter.stamp() - record_.last_measurement());
  const nav::Vector3 grown_m = dt_s * filter.velocity_difference_mps();
  const float east_m = z.nu(0) - innovation_.east_m - grown_m(0);
  const float north_m = z.nu(1) - innovation_.north_m - grown_m(1);
  const float moved_m2 = 0.5F * (p(0, 0) + p(1, 1) + dt_s * dt_s * (p(kEast, kEast) + p(kNorth, kNorth)));
  return east_m * east_m + north_m * north_m > checks::kChiSquare999Of2 * (2.0F * z.r(0) + moved_m2);
}

/// The filter refuses a second fix while a velocity contradicts it, too, or did within five seconds, and none vouches.
/// A receiver that leapt is one device with its velocity.
inline bool GnssPositionSource::filter_wrong(const FilterView& filter) const {
  if (record_.refused().count() < 2 || leapt_) return false;
  if (filter.recovery().widened_lately(filter.stamp())) return true;
  const base::Micros since = record_.since(filter.stamp());
  return filter.speeds_contradict() && filter.velocity_vote(since) != Vote::kFor &&
         filter.wheels_vote(since) != Vote::kFor;
}

/// A fix that would decide where the filter is waits for others that agree.
inline void GnssPositionSource::confirm(Assessment& a, const param::RecoveryParameters& n) {
  if (offset_.confirmed(n.confirm_fixes)) return;
  a.action = Action::kSkip;
  a.verdict = sensor::Verdict::kNotUsed;
  a.failed = Check::kUnconfirmed;
  status_.confirming();
}

/// A filter that refuses fixes may have moved otherwise than it thinks, by as much as it is uncertain in any direction.
/// Twice the least eigenvalue stands for it: a filter that is held to a line is wrong across it, however little it
/// knows along it.
inline void GnssPositionSource::judge_refused(const FixMeasurement& z, const FilterView& filter, Assessment& a) {
  const param::RecoveryParameters& n = filter.parameters().recovery;
  const nav::Ins::Covariance& p = filter.p();
  const float half = 0.5F * (p(0, 0) - p(1, 1)), both = p(0, 1);
  const float longer = 2.0F * base::sqrt(half * half + both * both);
  offset_.update(filter.stamp(), z.nu(0), z.nu(1), z.r(0), p(0, 0) + p(1, 1) - longer);
  leapt_ = leapt_ && !offset_.contradicted();  // fixes that go on moving may be on the way back
  a.action = Action::kReject;
  a.verdict = sensor::Verdict::kRejected;
  status_.rejecting(a.failed);
  const bool confirmed = offset_.confirmed(n.confirm_fixes);
  if (confirmed && !pull_inflated_) {  // the fixes before may have begun to lead the filter away
    a.remedy.pulled_m = pulled_m_;
    pull_inflated_ = true;
  }
  if (!reset_allowed(z, filter, a)) return;
  a.action = Action::kResetPosition;
  a.verdict = sensor::Verdict::kAccepted;
  a.cause = sensor::ResetCause::kPositionJump;
  a.remedy.step_m = {offset_.east_m(), offset_.north_m(), 0.0F};
  a.remedy.variance_m2 = z.r;
  record_.reset_refusals();
}

/// The refused fixes persist, or agree with where the last reset came from, or the filter is lost.
inline bool GnssPositionSource::reset_allowed(const FixMeasurement& z, const FilterView& filter, Assessment& a) const {
  const param::RecoveryParameters& n = filter.parameters().recovery;
  const bool confirmed = offset_.confirmed(n.confirm_fixes);
  a.remedy.undoes = confirmed && undoes_reset(z, filter);
  return a.remedy.undoes || (confirmed && lost(filter)) ||
         offset_.persisted(base::Micros{n.persist_us}, n.persist_fixes);
}

/// Back to where the last reset came from: dead reckoning before it and fixes after it agree.
inline bool GnssPositionSource::undoes_reset(const FixMeasurement& z, const FilterView& filter) const {
  const Recovery& recovery = filter.recovery();
  const float p_level = filter.p()(0, 0) + filter.p()(1, 1);
  return recovery.undoable() &&
         offset_.agrees(-recovery.jump().east_m, -recovery.jump().north_m, 2.0F * z.r(0) + p_level);
}

/// Fixes that agree with nothing for very long: the filter is no judge of how it moves. Without another witness of the
/// motion, and where the offset is not one that lasts, soon. Else when the receiver's velocity contradicts the filter,
/// too, for as long as an offset has to last: the receiver alone is right then.
inline bool GnssPositionSource::lost(const FilterView& filter) const {
  const param::RecoveryParameters& n = filter.parameters().recovery;
  const base::Micros refused = record_.refused().held_for(filter.stamp());
  if (filter.wheels_timed_out() && !filter.velocity_recent())
    return refused >= base::Micros{4 * std::int64_t{n.after_us}} && !offset_.persisted({refused.us / 2}, 0);
  return filter.speeds_contradict() &&
         record_.refused().persists(filter.stamp(), base::Micros{n.persist_us}, n.persist_fixes);
}

}  // namespace tetap::estimators
