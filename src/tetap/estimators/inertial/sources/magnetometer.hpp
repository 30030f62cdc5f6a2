// SPDX-License-Identifier: Apache-2.0
// Magnetometer. Its errors last, so its headings never make the filter's better than sigma_rad: each is given the
// variance that would end there. While the heading is better known already, headings are compared and nothing more.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/checks/magnetic_field_check.hpp"
#include "tetap/checks/stuck_value.hpp"
#include "tetap/estimators/inertial/heading_monitor.hpp"
#include "tetap/model/magnetic_heading.hpp"
#include "tetap/sensor/magnetic_field.hpp"

namespace tetap::estimators {

/// A field at the filter's time.
struct FieldMeasurement {
  std::array<float, 3> flux_uT{};                ///< along the sensor's axes, as it came
  nav::Vector3 b_uT = nav::Vector3::Zero();      ///< along the body's axes
  nav::Vector3 level_uT = nav::Vector3::Zero();  ///< along the place's level axes, by the filter or by levelling
  bool moving = false;                           ///< by the filter's velocity or turn rate
  model::DirectionMeasurement direction{};
};

class Magnetometer {
 public:
  using Measurement = FieldMeasurement;

  /// The field is carried to the filter's time, that of the last IMU sample; `level`: attitude before the filter runs.
  [[nodiscard]] static FieldMeasurement measurement(const sensor::MagneticFlux& flux, const nav::Quaternion& level,
                                                    const FilterView& filter);
  /// Strength and dip, and whether the sensor is stuck. At rest a good one shows the same for long.
  [[nodiscard]] Assessment assess_field(const FieldMeasurement& z, const FilterView& filter);
  /// Compares the heading with the filter's, and with the motion's on a robot without wheels. A magnetometer that is
  /// wrong all the time leads the filter's heading, which then agrees with it.
  [[nodiscard]] Assessment assess(const FieldMeasurement& z, const FilterView& filter);
  /// The measurement with the variance at which the filter's heading ends at sigma_rad. False: the heading is as well
  /// known already, and an update would change nothing.
  [[nodiscard]] static bool weigh(FieldMeasurement& z, const FilterView& filter);

  /// Another field became the known one with the last sample.
  [[nodiscard]] bool field_renewed() const { return field_.renewed(); }
  [[nodiscard]] bool trusted() const { return field_.trusted(); }
  void distrust(base::Micros at) { field_.set_trusted(false, at); }
  [[nodiscard]] bool is_suspect(base::Micros at) const { return field_.is_suspect(at); }
  [[nodiscard]] bool stuck(base::Micros at) const { return repeats_.stuck(at); }
  [[nodiscard]] bool timed_out(base::Micros at) const {
    return !checks::recent(repeats_.last(), at, base::Micros{2'000'000});
  }
  [[nodiscard]] SourceStatus status(base::Micros at) const { return timed_out(at) ? SourceStatus{} : status_; }
  static constexpr auto members(auto& self) { return base::members(self.field_, self.repeats_, self.status_); }

 private:
  /// Variance of the direction, and its covariance with the heading.
  struct Expected {
    float variance = 0, with_heading = 0;
  };
  [[nodiscard]] static Expected expected(const model::DirectionMeasurement& direction, const FilterView& filter);
  void judge_trust(Assessment& a, float nu, const FilterView& filter);

  checks::MagneticFieldCheck field_;
  checks::StuckValue<3> repeats_;
  SourceStatus status_;
};

inline FieldMeasurement Magnetometer::measurement(const sensor::MagneticFlux& flux, const nav::Quaternion& level,
                                                  const FilterView& filter) {
  const param::MagneticParameters& n = filter.parameters().magnetic;
  const nav::Vector3 rate = filter.tracking() ? filter.turn_b_radps() : filter.rate_b_radps();
  const nav::Vector3 shown = sensor::field_b_uT(flux, n);
  FieldMeasurement z{.flux_uT = flux.flux_b_uT};
  z.b_uT = shown + nav::cross(rate * base::seconds(filter.stamp() - filter.time()), shown);
  z.level_uT = filter.tracking() ? filter.level().from_map(filter.x().q_nb.rotate(z.b_uT)) : level.rotate(z.b_uT);
  z.direction = model::MagneticHeading(z.b_uT, n.declination_rad, n.sigma_rad);
  z.direction.q_nl = filter.level().q_nl;
  z.moving = filter.tracking() && (filter.x().v_n_mps.squaredNorm() > 0.25F || rate.squaredNorm() > 0.04F);
  return z;
}

inline Assessment Magnetometer::assess_field(const FieldMeasurement& z, const FilterView& filter) {
  const param::MagneticParameters& n = filter.parameters().magnetic;
  const float horizontal2 = z.level_uT(0) * z.level_uT(0) + z.level_uT(1) * z.level_uT(1);
  if (!(horizontal2 > 0.0F && z.b_uT.squaredNorm() < 1e12F))
    return {.action = Action::kReject, .failed = Check::kValue, .verdict = sensor::Verdict::kNotFinite};
  if (repeats_.update(z.flux_uT, z.moving ? n.stuck_samples : 0, filter.stamp())) {
    status_.distrusted(Check::kStuck);
    return {.action = Action::kSkip, .failed = Check::kStuck, .verdict = sensor::Verdict::kStale};
  }
  const float off =
      field_.update({.horizontal_uT = base::sqrt(horizontal2), .up_uT = z.level_uT(2)}, z.moving, filter.stamp(), n);
  if (off <= 1.0F) return {};
  status_.rejecting(Check::kField);
  return {.action = Action::kReject,
          .failed = Check::kField,
          .verdict = sensor::Verdict::kRejected,
          .statistic = off,
          .limit = 1.0F};
}

inline Magnetometer::Expected Magnetometer::expected(const model::DirectionMeasurement& direction,
                                                     const FilterView& filter) {
  const auto at = direction.linearised(filter.x());
  Expected e;
  for (int c = 0; c < 3; ++c) {
    float column = 0;
    for (int r = 0; r < 3; ++r)
      column += at.h(0, r) * filter.p()(nav::InsState::kAttitude + r, nav::InsState::kAttitude + c);
    e.variance += column * at.h(0, c);
    e.with_heading = column;
  }
  return e;
}

inline Assessment Magnetometer::assess(const FieldMeasurement& z, const FilterView& filter) {
  const param::MagneticParameters& n = filter.parameters().magnetic;
  const auto at = z.direction.linearised(filter.x());
  const float nu = z.direction.residual(at.z_hat)(0);
  const float variance = expected(z.direction, filter).variance + n.sigma_rad * n.sigma_rad;
  Assessment a{.dof = 1, .nis = nu * nu / variance, .gate = n.gate_scale * filter::chi_square_99(1)};
  if (!(a.nis < 1e30F))  // a field straight down
    return {.action = Action::kReject, .failed = Check::kValue, .verdict = sensor::Verdict::kNotFinite};
  const bool judged = filter.wheels_timed_out() && filter.position_holds_heading();
  const float yaw_rad = nav::euler(filter.x().q_nb).yaw_rad;
  const float sigmas = judged ? filter.heading_monitor().contradicts(yaw_rad + nu, n.sigma_rad) : 0.0F;
  if (sigmas > 0.0F) {
    a.failed = Check::kHeading;
    a.statistic = sigmas * sigmas;
    a.limit = HeadingMonitor::kSigmas * HeadingMonitor::kSigmas;
  } else if (!(a.nis <= a.gate)) {
    a.failed = Check::kGate;
  }
  judge_trust(a, nu, filter);
  return a;
}

/// With GNSS the filter's heading is the better one. Without, nothing else shows where north is.
inline void Magnetometer::judge_trust(Assessment& a, float nu, const FilterView& filter) {
  const base::Micros after{filter.parameters().recovery.after_us}, stamp = filter.stamp();
  const bool agrees = a.failed == Check::kNone;
  if (!agrees) {
    a.action = Action::kReject;
    a.verdict = sensor::Verdict::kRejected;
  }
  if (field_.trust_changes(agrees, stamp, after)) {
    if (agrees || filter.position_holds_heading()) {
      field_.set_trusted(agrees, stamp);
    } else {
      field_.set_trusted(true, stamp);
      a.action = Action::kInflateHeading;
      a.cause = sensor::ResetCause::kMagneticField;
      a.remedy.sigma_rad = nu;
    }
  }
  if (agrees && !field_.trusted()) {
    a.action = Action::kSkip;
    a.verdict = sensor::Verdict::kNotUsed;
    a.failed = Check::kTrust;
  }
  if (!field_.trusted()) {
    status_.distrusted(a.failed);
  } else if (agrees) {
    status_.fused();
  } else {
    status_.rejecting(a.failed);
  }
}

inline bool Magnetometer::weigh(FieldMeasurement& z, const FilterView& filter) {
  const float sigma_rad = filter.parameters().magnetic.sigma_rad, floor = sigma_rad * sigma_rad;
  const float p_yaw = filter.p()(nav::InsState::kYaw, nav::InsState::kYaw);
  if (!(p_yaw > kLeastVarianceRatio * floor)) return false;
  const Expected e = expected(z.direction, filter);
  const float target_variance = e.with_heading * e.with_heading / (p_yaw - floor) - e.variance;
  z.direction.sigma_rad = base::sqrt(target_variance > floor ? target_variance : floor);
  return true;
}

}  // namespace tetap::estimators
