// SPDX-License-Identifier: Apache-2.0
// Wheels: encoder counts or speeds of two wheels, as far as they roll. Their forward speed is a source of its own.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/checks/wheel_slip.hpp"
#include "tetap/estimators/inertial/encoder_interval.hpp"
#include "tetap/estimators/inertial/filter_view.hpp"
#include "tetap/estimators/inertial/wheel_reading.hpp"

namespace tetap::estimators {

class Wheels {
 public:
  using Measurement = WheelReading;
  using Slip = checks::WheelSlip::Slip;

  [[nodiscard]] EncoderInterval& encoders() { return encoders_; }
  [[nodiscard]] const EncoderInterval& encoders() const { return encoders_; }
  [[nodiscard]] Slip slip() const { return slip_.slip(); }
  [[nodiscard]] float turn_radps() const { return turn_radps_; }
  [[nodiscard]] base::Micros turned_at() const { return turned_at_; }

  /// A counter is broken: nothing is learnt of the wheels.
  [[nodiscard]] bool leapt(base::Micros stamp) {
    const bool leapt = encoders_.leapt_recently(stamp);
    if (leapt) status_.rejecting(Check::kValue);
    return leapt;
  }
  /// Decides which wheels roll. Without a gyroscope the wheels alone show a turn, and cannot be judged by it.
  [[nodiscard]] Assessment assess(const WheelReading& z, const FilterView& filter);
  /// Forward speed of an assessed reading: the mean of both wheels, also where they rest and deny a turn. When one
  /// rolls while the other spins, it is what the gyroscope leaves of the rolling one at the middle of the axle.
  [[nodiscard]] ForwardReading forward(const WheelReading& z, const FilterView& filter) const;
  /// GNSS velocity of the middle of the axle. True: it contradicts the wheels, so the filter's velocity is as wrong.
  [[nodiscard]] bool contradicted_by_ground(float forward_mps, float wheels_mps, float sigma_mps, base::Micros stamp,
                                            const param::InertialParameters& n) {
    return slip_.update_ground(forward_mps, wheels_mps, sigma_mps, stamp, n);
  }
  /// The filter gave way: differences so far were its own error.
  void reset_slip() { slip_.reset(); }

  [[nodiscard]] bool timed_out(base::Micros at) const {
    return !checks::recent(slip_.last(), at, base::Micros{1'500'000}) && !encoders_.leapt_recently(at);
  }
  [[nodiscard]] SourceStatus status(base::Micros at) const { return timed_out(at) ? SourceStatus{} : status_; }
  static constexpr auto members(auto& self) {
    return base::members(self.encoders_, self.slip_, self.turned_at_, self.turn_radps_, self.status_);
  }

 private:
  [[nodiscard]] float rim_difference_mps(const FilterView& filter) const {
    const float track_m = filter.parameters().wheels.drive.track_m;
    return filter.imu_missing() ? track_m * turn_radps_ : track_m * filter.turn_b_radps()(2);
  }

  EncoderInterval encoders_;
  checks::WheelSlip slip_;
  base::Micros turned_at_;  ///< stamp of the last wheels that rolled; 0: none
  float turn_radps_ = 0;    ///< turn rate by the wheels, low-passed: a count is much within one interval
  SourceStatus status_;
};

inline Assessment Wheels::assess(const WheelReading& z, const FilterView& filter) {
  const param::InertialParameters& n = filter.parameters().inertial;
  const float track_m = filter.parameters().wheels.drive.track_m;
  if (!filter.tracking() || !(track_m > 0)) return {};
  const nav::Vector3 v_b = filter.x().q_nb.conjugate().rotate(filter.x().v_n_mps);
  const nav::Ins::Covariance& p = filter.p();
  const float east = p(nav::InsState::kVelocity, nav::InsState::kVelocity);
  const float north = p(nav::InsState::kVelocityNorth, nav::InsState::kVelocityNorth);
  const float worst = east > north ? east : north;
  const checks::WheelSlip::Motion motion{
      .forward_mps = v_b(0),
      .sigma_mps = base::sqrt(worst),
      .turn_mps = rim_difference_mps(filter),
      .still_mps = encoders_.at_rest(filter.stamp()) ? track_m * n.still_radps : base::kInfinity};
  const Slip slip = slip_.update(z.wheels, motion, filter.stamp(), n);
  if (slip == Slip::kNone) {
    constexpr float kShare = 0.2F;
    turned_at_ = filter.stamp();
    turn_radps_ += kShare * ((z.wheels.right_mps - z.wheels.left_mps) / track_m - turn_radps_);
    status_.fused();
    return {};
  }
  status_.rejecting(Check::kSlip);
  const bool usable = slip != Slip::kBoth && !filter.imu_missing();
  Assessment a{.action = usable ? Action::kFuse : Action::kReject,
               .failed = usable ? Check::kNone : Check::kSlip,
               .verdict = usable ? sensor::Verdict::kAccepted : sensor::Verdict::kRejected};
  constexpr float kCircle_rad = 3.1415927F;
  const float turned_rad = filter.imu_missing() ? 0.0F : base::abs(slip_.turned_m()) / track_m;
  a.remedy.sigma_rad = turned_rad < kCircle_rad ? turned_rad : kCircle_rad;
  return a;
}

inline ForwardReading Wheels::forward(const WheelReading& z, const FilterView& filter) const {
  if (!filter.tracking() || !(filter.parameters().wheels.drive.track_m > 0))
    return {.mps = z.mean_mps(), .sigma_mps = z.sigma_mps};
  if (slip_.mean_holds()) return {.mps = z.mean_mps() + z.later_mps, .sigma_mps = z.sigma_mps};
  const float turn = rim_difference_mps(filter);
  const float one = slip() == Slip::kLeft ? z.wheels.right_mps - 0.5F * turn : z.wheels.left_mps + 0.5F * turn;
  constexpr float kOneWheel = 1.42F;  // of one wheel, not the mean of two
  const nav::Vector3 v_b = filter.x().q_nb.conjugate().rotate(filter.x().v_n_mps);
  const float alone = kOneWheel * filter.parameters().inertial.slip_share * v_b(0);
  return {.mps = one + z.later_mps, .sigma_mps = base::sqrt(2.0F * z.sigma_mps * z.sigma_mps + alone * alone)};
}

}  // namespace tetap::estimators
