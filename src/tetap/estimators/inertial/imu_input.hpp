// SPDX-License-Identifier: Apache-2.0
// The IMU as the filter at the horizon uses it: its health, its last turn rate, and where the filter went without it.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/checks/imu_drift.hpp"
#include "tetap/checks/imu_health.hpp"
#include "tetap/estimators/inertial/source.hpp"
#include "tetap/sensor/row_major.hpp"

namespace tetap::estimators {

/// Increments along the body's axes.
[[nodiscard]] inline nav::ImuIncrement mounted(const nav::ImuIncrement& s, const param::InertialParameters& n) {
  return {.dtheta_b_rad = sensor::times(n.mounting_bs, s.dtheta_b_rad),
          .dv_b_mps = sensor::times(n.mounting_bs, s.dv_b_mps),
          .dt = s.dt};
}

class ImuInput {
 public:
  [[nodiscard]] checks::ImuHealth& health() { return health_; }
  [[nodiscard]] const checks::ImuHealth& health() const { return health_; }
  [[nodiscard]] checks::ImuDrift& drift() { return drift_; }
  /// Turn rate as the gyroscope shows it, at the filter's time; its bias is in it.
  [[nodiscard]] const nav::Vector3& rate_b_radps() const { return rate_b_radps_; }
  /// The rate as a sample without one before it shows it: it is taken to be steady.
  void set_rate(const nav::Vector3& rate_b_radps) { rate_b_radps_ = end_rate_b_radps_ = rate_b_radps; }
  /// The rate of a sample that follows the last one.
  void follow_rate(const nav::Vector3& rate_b_radps) {
    end_rate_b_radps_ = rate_b_radps + 0.5F * (rate_b_radps - rate_b_radps_);
    rate_b_radps_ = rate_b_radps;
  }
  /// The same rate at the end of the last sample, where rate_b_radps() is that sample's mean.
  [[nodiscard]] const nav::Vector3& end_rate_b_radps() const { return end_rate_b_radps_; }
  /// The last sample was beyond the sensor's range, or at full scale where wheels show the turn.
  [[nodiscard]] bool unusable() const { return unusable_; }
  void set_unusable(bool unusable) { unusable_ = unusable; }
  void note_leap(base::Micros stamp) { leapt_at_ = stamp; }
  /// A sample leapt within the last second.
  [[nodiscard]] bool leapt_lately(base::Micros time) const {
    return checks::recent(leapt_at_, time, base::Micros{1'000'000});
  }
  /// Time to which the filter last went without IMU; 0: never.
  [[nodiscard]] base::Micros bridged_until() const { return bridged_until_; }
  void set_bridged(base::Micros until) { bridged_until_ = until; }

  /// The last step of a filter at `time` was without IMU.
  [[nodiscard]] bool missing(base::Micros time) const {
    return health_.stuck() || unusable_ || (bridged_until_.us > 0 && bridged_until_ == time);
  }
  /// Within the last second the filter went without IMU, or the IMU was stuck.
  [[nodiscard]] bool missing_lately(base::Micros time) const {
    return health_.stuck_lately(time) || checks::recent(bridged_until_, time, base::Micros{1'000'000});
  }
  [[nodiscard]] SourceStatus status(base::Micros at, const param::InertialParameters& n) const {
    if (health_.stuck()) return {SourceState::kDistrusted, Check::kStuck};
    if (health_.last_valid().us == 0 || health_.stale(at, n)) return {SourceState::kStopped, Check::kNone};
    if (drift_.shown()) return {SourceState::kDistrusted, Check::kDrift};
    return {unusable_ ? SourceState::kRejecting : SourceState::kFusing, unusable_ ? Check::kValue : Check::kNone};
  }

  static constexpr auto members(auto& self) {
    return base::members(base::in_turns(self.health_), base::in_turns(self.bridged_until_),
                         base::in_turns(self.leapt_at_), self.rate_b_radps_, base::unhashed(self.end_rate_b_radps_),
                         self.drift_, self.unusable_);
  }

 private:
  checks::ImuHealth health_;
  base::Micros bridged_until_;  ///< time to which the filter last went without IMU; 0: never
  base::Micros leapt_at_;       ///< stamp of the last sample that leapt; 0: none
  nav::Vector3 rate_b_radps_ = nav::Vector3::Zero();
  nav::Vector3 end_rate_b_radps_ = nav::Vector3::Zero();  ///< not hashed: the velocity shows it a sample later
  checks::ImuDrift drift_;
  bool unusable_ = false;
};

}  // namespace tetap::estimators
