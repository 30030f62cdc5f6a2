// SPDX-License-Identifier: Apache-2.0
// Inertial navigation: headings from outside, magnetometer, barometer.
#include "tetap/estimators/inertial/inertial.hpp"
#include "tetap/estimators/inertial/measure.hpp"

namespace tetap::estimators {

template <class Watch>
Innovation InertialWith<Watch>::fuse(const sensor::OutsideHeading& heading, base::Micros stamp, const Context& ctx) {
  const FilterView filter = view(stamp, ctx);
  const Assessment a = sources_.heading.assess(heading, filter);
  if (!a.fuses()) return record_of(a);
  if (!tracking()) {
    const float yaw_rad = OutsideHeadingSource::body_yaw_rad(heading, alignment_.attitude(), ctx.parameters.gnss);
    alignment_.set_heading(base::wrap_angle(yaw_rad + level_.convergence_rad()),
                           OutsideHeadingSource::sigma_rad(heading));
    return {.verdict = sensor::Verdict::kAccepted};
  }
  return measure(OutsideHeadingSource::model(heading, filter), sources_.heading, ctx.parameters.gnss.gate_scale,
                 filter);
}

template <class Watch>
Innovation InertialWith<Watch>::fuse(const sensor::MagneticFlux& flux, base::Micros stamp, const Context& ctx) {
  if (ctx.parameters.magnetic.use == 0 || phase_ == Phase::kLevelling) return {};
  const FilterView filter = view(stamp, ctx);
  Magnetometer& magnetometer = sources_.magnetometer;
  FieldMeasurement z = Magnetometer::measurement(flux, alignment_.attitude(), filter);
  const Assessment field = magnetometer.assess_field(z, filter);
  if (magnetometer.field_renewed()) recovery_.report(sensor::ResetCause::kMagneticField);
  if (!field.fuses()) return record_of(field);
  if (!tracking()) {
    if (!magnetometer.trusted()) return {.failed = Check::kTrust};
    alignment_.field(z.level_uT, z.direction.angle_rad + level_.convergence_rad(), ctx.parameters.magnetic.sigma_rad);
    return {.verdict = sensor::Verdict::kAccepted};
  }
  const Assessment a = magnetometer.assess(z, filter);
  apply(a, filter);
  if (a.fuses() && Magnetometer::weigh(z, filter)) static_cast<void>(update(z.direction, base::kInfinity));
  return record_of(a);
}

template <class Watch>
Innovation InertialWith<Watch>::fuse(const sensor::AirPressure& air, base::Micros stamp, const Context& ctx) {
  const FilterView filter = view(stamp, ctx);
  Barometer& barometer = sources_.barometer;
  if (!Barometer::starting_conditions(filter)) return {};
  const Assessment pressure = barometer.assess_pressure(air, filter);
  if (!pressure.fuses()) return record_of(pressure);
  const HeightMeasurement z = Barometer::measurement(air, filter);
  const Assessment a = barometer.assess(z, filter);
  apply(a, filter);
  if (a.fuses()) static_cast<void>(update(barometer.model(z, filter), base::kInfinity));
  return record_of(a);
}

}  // namespace tetap::estimators
