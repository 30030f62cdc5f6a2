// SPDX-License-Identifier: Apache-2.0
// Inertial navigation, part: barometric height.
#pragma once

#include "estimators/inertial/inertial.hpp"
#include "model/height.hpp"

namespace tetap::estimators {

[[gnu::noinline]] inline Innovation Inertial::fuse(const sensor::AirPressure& air, base::Micros stamp,
                                                   const Context& ctx) {
  const param::BaroParameters& n = ctx.parameters.baro;
  if (n.use == 0 || phase_ != Phase::kTracking) return {};
  constexpr float kLeast_Pa = 22'700;  // the model ends at 11 km
  if (!(air.pressure_Pa >= kLeast_Pa && air.pressure_Pa < 2e5F)) return {.verdict = sensor::Verdict::kNotFinite};
  if (pressures_.hear({air.pressure_Pa}, n.stuck_samples, stamp)) return {.verdict = sensor::Verdict::kStale};
  const float altitude_m = pressure_altitude_m(air.pressure_Pa);
  // The height at the sample's time; the state's is that of the last IMU sample.
  const float height_m = nav::difference(ins_.x.z, {}) + ins_.x.v_n_mps(2) * base::seconds(stamp - time_);
  const float white = n.sigma_m * n.sigma_m;
  const float p_z = ins_.p(2, 2);
  if (!baro_.known()) {
    baro_.set(altitude_m, altitude_m - height_m, p_z + white, stamp);
    return {.verdict = sensor::Verdict::kAccepted};
  }
  baro_.predict(stamp, n);
  const float p_b = baro_.variance(altitude_m, n);
  const float nu = altitude_m - baro_.zero_m() - height_m;
  const float gate = n.gate_scale * filter::chi_square_99(1);
  Innovation result{
      .verdict = sensor::Verdict::kRejected, .dof = 1, .nis = nu * nu / (p_z + p_b + white), .gate = gate};
  if (!(result.nis < 1e30F)) return {.verdict = sensor::Verdict::kNotFinite};
  if (result.nis > gate) {
    // A door, a hatch, a gust: pressure that stays different is a new zero.
    if (baro_.refused_for(stamp) >= base::Micros{ctx.parameters.recovery.after_us}) {
      baro_.set(altitude_m, altitude_m - height_m, p_z + white, stamp);
      say(sensor::ResetCause::kBarometerZero);
    }
    return result;
  }
  result.verdict = sensor::Verdict::kAccepted;
  baro_.agreed(stamp);
  constexpr float kWorth = 1.05F;  // of its variance the other has to be off, for an update to change anything
  if (p_z > kWorth * p_b) {
    const model::Height model{.z = ins_.x.z.plus(nu), .sigma_m = base::sqrt(white + variance_towards(p_b, p_z))};
    static_cast<void>(update(model, base::kInfinity));
  } else if (p_b > kWorth * p_z) {
    baro_.correct(nu, p_b, p_z, white, altitude_m);
  }
  return result;
}

}  // namespace tetap::estimators
