// SPDX-License-Identifier: Apache-2.0
// GNSS velocity. A receiver and a filter that contradict each other: either may be wrong. Wheels and fixes vote
// (vote.hpp).
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/estimators/inertial/filter_view.hpp"
#include "tetap/estimators/inertial/refusal.hpp"
#include "tetap/model/gnss_velocity_3d.hpp"

namespace tetap::estimators {

struct VelocityMeasurement {
  nav::Vector3 v_n_mps = nav::Vector3::Zero();  ///< at the time of the last IMU sample
  nav::Vector3 v_b_mps = nav::Vector3::Zero();  ///< velocity of the middle of the axle, along the body's axes
  float sigma_mps = 0;                          ///< 1 sigma per axis
  bool has_climb = true;                        ///< false: the vertical part is the filter's own

  [[nodiscard]] float level_mps() const { return base::sqrt(v_b_mps(0) * v_b_mps(0) + v_b_mps(1) * v_b_mps(1)); }
};

class GnssVelocitySource {
 public:
  using Measurement = VelocityMeasurement;

  /// A receiver's velocity, which came along the level axes of the place, along the map's. A climb rate that is not
  /// there is 0.
  [[nodiscard]] static VelocityMeasurement measurement(const sensor::GnssVelocity& velocity,
                                                       const nav::LocalLevel& place, const param::GnssParameters& n) {
    const bool has_climb = base::is_finite(velocity.v_n_mps[2]);
    const nav::Vector3 v_l{velocity.v_n_mps[0], velocity.v_n_mps[1], has_climb ? velocity.v_n_mps[2] : 0.0F};
    const float own = base::is_finite(velocity.acc_mps) ? velocity.acc_mps : 0.5F;
    return {.v_n_mps = place.to_map(v_l),
            .sigma_mps = own > n.sigma_velocity_floor_mps ? own : n.sigma_velocity_floor_mps,
            .has_climb = has_climb};
  }
  /// The receiver does not repeat its positions; a frozen receiver's velocities are as old.
  [[nodiscard]] static bool continuing_conditions(const FilterView& filter) { return !filter.position_frozen(); }
  /// The innovation gate follows in the update.
  [[nodiscard]] Assessment assess(const VelocityMeasurement&, const FilterView&) { return {}; }
  /// A velocity came. Between two of them the filter moves as the IMU feels: a leap of their difference is the
  /// receiver's, until the difference is gone.
  void note(const VelocityMeasurement& z, const FilterView& filter) {
    const nav::Vector3 off = z.v_n_mps - filter.x().v_n_mps;
    const float dt_s = base::seconds(filter.stamp() - record_.last_measurement());
    const float unmodelled = kUnmodelled_mps + kUnmodelled_mps2 * dt_s;
    const float most2 = 9.0F * (2.0F * z.sigma_mps * z.sigma_mps + unmodelled * unmodelled);
    const float off2 = off.squaredNorm();
    const bool leaps = dt_s < 1.5F && off2 > most2 && nav::Vector3(off - difference_mps_).squaredNorm() > most2;
    step_detected_ = (step_detected_ || leaps) && off2 >= 0.5F * most2 && filter.wheels_agree();
    climb_mps_ += (dt_s < 1.5F ? kNewest : 1.0F) * (filter.level().up_n.dot(off) - climb_mps_);
    sigma_mps_ = z.sigma_mps;
    difference_mps_ = off;
    ahead_mps_ = z.v_b_mps(0);
  }
  [[nodiscard]] bool step_detected() const { return step_detected_; }
  /// Climb rate that the filter lacks by the last velocities; 0 where their mean fits the filter's own.
  [[nodiscard]] float missing_climb_mps(const FilterView& filter) const {
    constexpr float kSigmas2 = 9, kShare = kNewest / (2 - kNewest);
    const float sigma_mps = kVertical * sigma_mps_;
    const float variance =
        kShare * sigma_mps * sigma_mps + filter.p()(nav::InsState::kVelocityUp, nav::InsState::kVelocityUp);
    return recent(filter.stamp()) && climb_mps_ * climb_mps_ > kSigmas2 * variance ? climb_mps_ : 0.0F;
  }
  /// Difference of the last velocity to the filter's.
  [[nodiscard]] const nav::Vector3& difference_mps() const { return difference_mps_; }
  /// Speed ahead by the last velocity.
  [[nodiscard]] float ahead_mps() const { return ahead_mps_; }
  [[nodiscard]] static model::GnssVelocity3d model(const VelocityMeasurement& z, const FilterView& filter) {
    const param::GnssParameters& n = filter.parameters().gnss;
    // The climb that was filled in is the filter's own: where the plane leans, its error shows in the horizontal part.
    const nav::Vector3& up_n = filter.level().up_n;
    const float lean2 = z.has_climb ? 0.0F : up_n(0) * up_n(0) + up_n(1) * up_n(1);
    return {.v_n_mps = z.v_n_mps,
            .sigma_horizontal_mps = base::sqrt(
                z.sigma_mps * z.sigma_mps + lean2 * filter.p()(nav::InsState::kVelocityUp, nav::InsState::kVelocityUp)),
            .sigma_vertical_mps = z.has_climb ? kVertical * z.sigma_mps : kNoClimb_mps,
            .antenna_b_m = {n.antenna_x_b_m, n.antenna_y_b_m, n.antenna_z_b_m},
            .gyro_b_radps = filter.rate_b_radps()};
  }
  /// Without a climb rate the gate is that of the horizontal part.
  [[nodiscard]] static float gate_scale(const VelocityMeasurement& z, const param::GnssParameters& n) {
    return (z.has_climb ? 1.0F : filter::chi_square_99(2) / filter::chi_square_99(3)) * n.gate_scale;
  }
  /// The update's verdict; nu: the innovation.
  void conclude(Assessment& a, const nav::Vector3& nu, const FilterView& filter) {
    const bool rejected = a.action == Action::kReject;
    record_.update(rejected, filter.stamp());
    if (!rejected) return;
    const base::Micros since = record_.since(filter.stamp());
    if (filter.receiver_leapt() || filter.barometer_vouches(missing_climb_mps(filter), since)) return;
    judge_velocity(a, nu, filter.wheels_vote(since), vote_of_fixes(nu, since, filter), record_, filter);
  }
  void begin() { record_.begin(); }

  [[nodiscard]] const DeviceRecord& witness() const { return record_; }
  [[nodiscard]] const checks::Persistence& refused() const { return record_.refused(); }
  /// A velocity came within one second.
  [[nodiscard]] bool recent(base::Micros at) const { return checks::recent(record_.last_measurement(), at, kFresh); }
  [[nodiscard]] bool timed_out(base::Micros at) const {
    return checks::older(record_.last_measurement(), at, kFresh + kFresh);
  }
  [[nodiscard]] SourceStatus status(base::Micros at) const {
    return timed_out(at) ? SourceStatus{} : status_of(record_.refused());
  }
  static constexpr auto members(auto& self) {
    return base::members(self.record_, self.difference_mps_, self.climb_mps_, self.sigma_mps_, self.ahead_mps_,
                         self.step_detected_);
  }

 private:
  static constexpr base::Micros kFresh{1'000'000};
  static constexpr float kNoClimb_mps = 1e3F;  ///< sigma of a climb rate that is not there (NMEA has none)
  static constexpr float kVertical = 1.5F;     ///< sigma of a climb rate in that of a level velocity
  static constexpr float kNewest = 0.2F;       ///< weight of the newest climb rate in the mean

  static constexpr float kUnmodelled_mps = 0.05F,
                         kUnmodelled_mps2 = 0.3F;  ///< the IMU's own error between two velocities

  /// Fixes and velocity are one device: against the filter they add nothing where wheels may still decide.
  [[nodiscard]] static Vote vote_of_fixes(const nav::Vector3& nu, base::Micros since, const FilterView& filter) {
    const Vote vote = filter.fixes_vote(since, nu);
    return vote == Vote::kAgainst && !filter.wheels_timed_out() ? Vote::kAbstains : vote;
  }

  DeviceRecord record_;
  nav::Vector3 difference_mps_ = nav::Vector3::Zero();  ///< difference of the last velocity to the filter's
  float climb_mps_ = 0;  ///< mean difference of the last five or so climb rates to the filter's
  float sigma_mps_ = 0;  ///< 1 sigma of the last velocity along a level axis
  float ahead_mps_ = 0;
  bool step_detected_ = false;  ///< the receiver leapt, and is not back
};

}  // namespace tetap::estimators
