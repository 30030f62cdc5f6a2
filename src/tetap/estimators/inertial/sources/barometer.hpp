// SPDX-License-Identifier: Apache-2.0
// Barometer: of the height and the barometer's zero the one that is known worse is corrected by the other.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/checks/stuck_value.hpp"
#include "tetap/estimators/inertial/barometer_zero.hpp"
#include "tetap/estimators/inertial/filter_view.hpp"
#include "tetap/model/height.hpp"

namespace tetap::estimators {

struct HeightMeasurement {
  float altitude_m = 0;  ///< by the pressure
  float height_m = 0;    ///< the filter's above the origin's level surface, at the sample's time
};

class Barometer {
 public:
  using Measurement = HeightMeasurement;

  [[nodiscard]] static bool starting_conditions(const FilterView& filter) {
    return filter.parameters().baro.use != 0 && filter.tracking();
  }
  /// Range, and whether the sensor is stuck.
  [[nodiscard]] Assessment assess_pressure(const sensor::AirPressure& air, const FilterView& filter);
  [[nodiscard]] static HeightMeasurement measurement(const sensor::AirPressure& air, const FilterView& filter) {
    const float later_s = base::seconds(filter.stamp() - filter.time());
    return {.altitude_m = pressure_altitude_m(air.pressure_Pa),
            .height_m = filter.height_m() + filter.level().up_n.dot(filter.x().v_n_mps) * later_s};
  }
  /// kFuse: the filter is to be updated with model(). kSkip, accepted: the zero took the correction, or needs none.
  [[nodiscard]] Assessment assess(const HeightMeasurement& z, const FilterView& filter);
  [[nodiscard]] model::Height model(const HeightMeasurement& z, const FilterView& filter) const {
    const param::BaroParameters& n = filter.parameters().baro;
    const float p_b = zero_.variance(z.altitude_m, n), white = n.sigma_m * n.sigma_m;
    return {.z = filter.x().z.plus(innovation_m(z)),
            .sigma_m = base::sqrt(white + variance_towards(p_b, filter.p()(2, 2)))};
  }
  /// Pressure that stays different (a door, a hatch, a gust) is a new zero.
  [[nodiscard]] bool reset_allowed(const FilterView& filter) const {
    return zero_.refused_for(filter.stamp()) >= base::Micros{filter.parameters().recovery.after_us};
  }

  /// The height agreed within a second, though a climb that is off by so much since then would have moved it. A zero
  /// shows nothing of the time before it was set.
  [[nodiscard]] bool vouches(float climb_mps, base::Micros since, const FilterView& filter) const {
    const param::BaroParameters& n = filter.parameters().baro;
    const base::Micros last = zero_.last();
    const bool agreed = last > since && checks::recent(last, filter.stamp(), base::Micros{1'000'000});
    if (!agreed || zero_.refused_for(last).us != 0) return false;
    const base::Micros span = last - since, known = zero_.known_for(last);
    const float off_m = kGrowth * climb_mps * base::seconds(known < span ? known : span);
    const float variance = filter.p()(2, 2) + zero_.variance() + n.sigma_m * n.sigma_m;
    return off_m * off_m > kPower * n.gate_scale * filter::chi_square_99(1) * variance;
  }
  /// Barometer and receiver contradict the filter to the same side: the IMU's climb is wrong, and no door changed the
  /// pressure.
  [[nodiscard]] bool climb_wrong(float nu_m, const FilterView& filter) const {
    constexpr base::Micros kLasts{200'000};
    return zero_.refused_for(filter.stamp()) >= kLasts && nu_m * filter.missing_climb_mps() > 0.0F;
  }

  [[nodiscard]] bool stuck(base::Micros at) const { return repeats_.stuck(at); }
  [[nodiscard]] bool timed_out(base::Micros at) const {
    return !checks::recent(repeats_.last(), at, base::Micros{2'000'000});
  }
  [[nodiscard]] SourceStatus status(base::Micros at) const {
    if (timed_out(at)) return {};
    if (stuck(at)) return {SourceState::kDistrusted, Check::kStuck};
    const bool agrees = zero_.refused_for(zero_.last()).us == 0;
    return agrees ? SourceStatus{SourceState::kFusing, Check::kNone}
                  : SourceStatus{SourceState::kRejecting, Check::kGate};
  }
  static constexpr auto members(auto& self) { return base::members(self.zero_, self.repeats_); }

 private:
  [[nodiscard]] float innovation_m(const HeightMeasurement& z) const {
    return z.altitude_m - zero_.zero_m() - z.height_m;
  }
  void set_zero(const HeightMeasurement& z, const FilterView& filter) {
    const float white = filter.parameters().baro.sigma_m * filter.parameters().baro.sigma_m;
    zero_.set(z.altitude_m, z.altitude_m - z.height_m, filter.p()(2, 2) + white, filter.stamp());
  }
  void judge_refused(const HeightMeasurement& z, const FilterView& filter, Assessment& a);

  static constexpr float kPower = 4;  ///< an agreement decides where the height would be off by two gates

  BarometerZero zero_;
  checks::StuckValue<1> repeats_;
};

inline Assessment Barometer::assess_pressure(const sensor::AirPressure& air, const FilterView& filter) {
  constexpr float kLeast_Pa = 22'700;  // the model ends at 11 km
  if (!(air.pressure_Pa >= kLeast_Pa && air.pressure_Pa < 2e5F))
    return {.action = Action::kReject, .failed = Check::kValue, .verdict = sensor::Verdict::kNotFinite};
  if (!repeats_.update({air.pressure_Pa}, filter.parameters().baro.stuck_samples, filter.stamp())) return {};
  return {.action = Action::kSkip, .failed = Check::kStuck, .verdict = sensor::Verdict::kStale};
}

inline Assessment Barometer::assess(const HeightMeasurement& z, const FilterView& filter) {
  const param::BaroParameters& n = filter.parameters().baro;
  if (!zero_.known()) {
    set_zero(z, filter);
    return {.action = Action::kSkip};
  }
  zero_.predict(filter.stamp(), n);
  const float white = n.sigma_m * n.sigma_m, p_z = filter.p()(2, 2);
  const float p_b = zero_.variance(z.altitude_m, n), nu = innovation_m(z);
  Assessment a{.dof = 1, .nis = nu * nu / (p_z + p_b + white), .gate = n.gate_scale * filter::chi_square_99(1)};
  if (!(a.nis < 1e30F))
    return {.action = Action::kReject, .failed = Check::kValue, .verdict = sensor::Verdict::kNotFinite};
  if (a.nis > a.gate) {
    judge_refused(z, filter, a);
    return a;
  }
  zero_.agreed(filter.stamp());
  if (p_z > kLeastVarianceRatio * p_b) return a;
  if (p_b > kLeastVarianceRatio * p_z) zero_.correct(nu, p_b, p_z, white, z.altitude_m);
  a.action = Action::kSkip;
  return a;
}

inline void Barometer::judge_refused(const HeightMeasurement& z, const FilterView& filter, Assessment& a) {
  a.reject(Check::kGate);
  const float nu = innovation_m(z);
  if (climb_wrong(nu, filter)) {
    a.action = Action::kWidenClimb;
    a.remedy.climb_mps = filter.missing_climb_mps();
    a.remedy.height_m = nu;
    zero_.agreed(filter.stamp());
    return;
  }
  if (!reset_allowed(filter)) return;
  set_zero(z, filter);
  a.action = Action::kResetZero;
  a.cause = sensor::ResetCause::kBarometerZero;
}

}  // namespace tetap::estimators
