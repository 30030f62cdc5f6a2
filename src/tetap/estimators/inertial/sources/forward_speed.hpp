// SPDX-License-Identifier: Apache-2.0
// Forward speed of wheels or of a speedometer, with the non-holonomic constraint; and the constraint alone, where no
// speed comes.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/estimators/inertial/filter_view.hpp"
#include "tetap/estimators/inertial/refusal.hpp"
#include "tetap/estimators/inertial/wheel_reading.hpp"
#include "tetap/model/wheel_speed.hpp"

namespace tetap::estimators {

class ForwardSpeedSource {
 public:
  using Measurement = ForwardReading;

  /// A forward speed as wheels or a speedometer show it, fused or not.
  void note(float mps, base::Micros stamp) {
    last_mps_ = mps;
    last_ = stamp;
  }
  /// The constraint without a speed, for a start in motion. Linearised about an uncertain speed and an uncertain
  /// heading, it leaves out the product of the two errors. While that product exceeds the mean of its noise over some
  /// samples, the constraint would take it for a heading.
  [[nodiscard]] bool starting_conditions(const FilterView& filter) {
    constexpr float kMean_s = 0.04F;
    const param::InertialParameters& n = filter.parameters().inertial;
    const nav::Ins::Covariance& p = filter.p();
    const float mean2 = n.lateral_mps * n.lateral_mps * base::seconds(base::Micros{n.constrain_every_us}) / kMean_s;
    const float level = p(nav::InsState::kVelocity, nav::InsState::kVelocity) +
                        p(nav::InsState::kVelocityNorth, nav::InsState::kVelocityNorth);
    speed_known_ = speed_known_ || level * p(nav::InsState::kYaw, nav::InsState::kYaw) < mean2;
    return speed_known_;
  }
  /// The innovation gate follows in the update.
  [[nodiscard]] Assessment assess(const ForwardReading&, const FilterView& filter) {
    fused_at_ = filter.stamp();
    return {};
  }
  [[nodiscard]] static model::WheelSpeed model(const ForwardReading& z, const FilterView& filter);
  void conclude(Assessment& a, const nav::Vector3& nu_b_mps, const FilterView& filter) {
    const bool rejected = !a.fuses();
    if (rejected) {
      status_.rejecting(a.failed);
    } else {
      status_.fused();
    }
    record_.update(rejected, filter.stamp());
    if (!rejected) return;
    if (timed_out(filter.stamp())) return yield_to_constraint(a, filter);
    judge(a, filter.x().q_nb.rotate(nu_b_mps), filter);
  }
  /// Both wheels spin, or the filter is wrong.
  [[nodiscard]] Assessment assess_spinning(float mean_mps, const FilterView& filter) {
    Assessment a{.action = Action::kReject, .failed = Check::kSlip, .verdict = sensor::Verdict::kRejected};
    record_.update(true, filter.stamp());
    status_.rejecting(Check::kSlip);
    judge(a, filter.x().q_nb.rotated_x() * (mean_mps - filter.forward_mps()), filter);
    return a;
  }
  /// `speed_known`: the filter begins at a speed that was measured or given.
  void begin(bool speed_known) {
    record_.begin();
    speed_known_ = speed_known;
  }
  /// The constraint without a speed was fused since `before`: it is no witness, and no judge of wheels that spin.
  void restore(const DeviceRecord& before, bool spinning) {
    if (spinning) {
      record_ = before;
    } else {
      record_.restore_stamps(before);
    }
  }

  [[nodiscard]] const DeviceRecord& witness() const { return record_; }
  [[nodiscard]] const checks::Persistence& refused() const { return record_.refused(); }
  [[nodiscard]] float last_mps() const { return last_mps_; }
  [[nodiscard]] base::Micros last() const { return last_; }
  [[nodiscard]] base::Micros fused_at() const { return fused_at_; }
  /// No speed came for 1.5 s; a speedometer may come once a second.
  [[nodiscard]] bool timed_out(base::Micros at) const { return !checks::recent(last_, at, base::Micros{1'500'000}); }
  [[nodiscard]] SourceStatus status(base::Micros at) const { return timed_out(at) ? SourceStatus{} : status_; }
  static constexpr auto members(auto& self) {
    return base::members(self.record_, self.last_, self.fused_at_, self.last_mps_, self.speed_known_, self.status_);
  }

 private:
  /// The constraint alone is no device: it shows no cause. Refused for long, it is right.
  void yield_to_constraint(Assessment& a, const FilterView& filter) {
    const param::RecoveryParameters& n = filter.parameters().recovery;
    if (!record_.refused().persists(filter.stamp(), base::Micros{n.after_us}, n.at_least)) return;
    a.action = Action::kInflateMotion;
    record_.reset_refusals();
  }
  void judge(Assessment& a, const nav::Vector3& nu_n_mps, const FilterView& filter) {
    const base::Micros since = record_.since(filter.stamp());
    judge_velocity(a, nu_n_mps, filter.velocity_vote(since), filter.fixes_vote(since, nu_n_mps), record_, filter);
  }

  DeviceRecord record_;
  base::Micros last_;         ///< stamp of the last forward speed of wheels or speedometer; 0: none
  base::Micros fused_at_;     ///< last stamp at which a speed, or the constraint alone, was fused; 0: never
  float last_mps_ = 0;        ///< last forward speed of wheels or speedometer
  bool speed_known_ = false;  ///< the constraint alone may be fused
  SourceStatus status_;
};

/// The noise grows with the filter's own speed: by the reading, readings that err to the slow side would count for
/// more. The reading is true at its own time, the state at that of the last IMU sample.
inline model::WheelSpeed ForwardSpeedSource::model(const ForwardReading& z, const FilterView& filter) {
  const param::InertialParameters& n = filter.parameters().inertial;
  const nav::Ins::Covariance& p = filter.p();
  const float variance = p(nav::InsState::kVelocity, nav::InsState::kVelocity) +
                         p(nav::InsState::kVelocityNorth, nav::InsState::kVelocityNorth) +
                         p(nav::InsState::kVelocityUp, nav::InsState::kVelocityUp);
  const nav::Vector3 ahead_n = filter.x().q_nb.rotated_x();
  const float own_mps = ahead_n.dot(filter.x().v_n_mps);
  const float slip2 = n.slip_share * n.slip_share * (own_mps * own_mps + variance);
  // Without a speed the filter itself has to be sure that it stands, or goes.
  constexpr float kSure_mps = 0.1F;
  const bool goes = z.sigma_mps < ForwardReading::kUnknown_mps
                        ? base::abs(z.mps) > 2.0F * n.wheel_mps
                        : variance > kSure_mps * kSure_mps || filter.x().v_n_mps.squaredNorm() > 9.0F * variance;
  return {.forward_mps = z.mps - ahead_n.dot(filter.ins().accel_n_mps2) * filter.later_s(),
          .sigma_forward_mps = base::sqrt(n.wheel_mps * n.wheel_mps + slip2 + z.sigma_mps * z.sigma_mps),
          .sigma_lateral_mps = n.lateral_mps,
          .sigma_vertical_mps = n.vertical_mps,
          .axle_b_m = {n.axle_x_b_m, 0.0F, 0.0F},
          .gyro_b_radps = filter.rate_b_radps(),
          .moves = goes && !filter.ins().stands};
}

}  // namespace tetap::estimators
