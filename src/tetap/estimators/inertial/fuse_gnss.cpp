// SPDX-License-Identifier: Apache-2.0
// Inertial navigation: GNSS position and velocity.
#include "tetap/estimators/inertial/inertial.hpp"
#include "tetap/estimators/inertial/measure.hpp"

namespace tetap::estimators {

template <class Watch>
Innovation InertialWith<Watch>::fuse(const sensor::GnssPosition& fix, base::Micros stamp, const Context& ctx) {
  budget_.spend(WorkBudget::kFixChecks);
  const bool starts = !tracking() && fix.fix >= sensor::GnssFix::k2d &&
                      sources_.position.starting_conditions(fix, stamp, ctx.parameters.recovery);
  GnssPositionSource::Converted converted = GnssPositionSource::convert(fix, level_.height_m, ctx);
  if (!converted.fix)
    return {.verdict = converted.outside ? sensor::Verdict::kNotFinite : sensor::Verdict::kNotUsed,
            .failed = converted.outside ? Check::kValue : Check::kNone};
  model::GnssFix3d& model = *converted.fix;
  if (!tracking()) {
    set_level(model.x, model.y, model.z, ctx);  // velocities and headings come before the filter runs, too
    if (!starts) return {.failed = Check::kUnconfirmed};
    alignment_.fix(model, stamp, heading_monitor_, ctx.parameters);
    return {.verdict = sensor::Verdict::kAccepted};
  }
  // The fix is true at its own time, the state at that of the last IMU sample: moved by the velocity in between.
  const float later_s = base::seconds(stamp - time_);
  nav::move(model.x, -ins_.x.v_n_mps(0) * later_s);
  nav::move(model.y, -ins_.x.v_n_mps(1) * later_s);
  nav::move(model.z, -ins_.x.v_n_mps(2) * later_s);
  const FilterView filter = view(stamp, ctx);
  if (!sources_.position.continuing_conditions(fix, model, filter))
    return {.verdict = sensor::Verdict::kStale, .failed = Check::kFrozen};
  heading_monitor_.fuse(model);
  if (filter.wheels_timed_out() && heading_monitor_.heading_wrong(filter)) {
    restart_filter(stamp, sensor::ResetCause::kHeadingWrong, ctx);
    return {.verdict = sensor::Verdict::kRejected, .failed = Check::kHeading};
  }
  return fuse_fix(model, filter);
}

/// Horizontal part, then the height: each may be fused, skipped, or reset by itself.
template <class Watch>
[[gnu::noinline]] Innovation InertialWith<Watch>::fuse_fix(model::GnssFix3d& fix, const FilterView& filter) {
  predict_covariance();
  const auto at = fix.linearised(ins_.x);
  FixMeasurement z{.nu = -at.z_hat, .r = fix.noise()};
  z.statistics = fix_statistics(ins_.p, {at.h(1, 5), -at.h(0, 5), at.h(0, 4)}, z.nu, z.r);
  if (!(z.statistics.joint_nis < 1e30F && z.r(0) < 1e12F && z.r(2) < 1e12F))
    return {.verdict = sensor::Verdict::kNotFinite, .failed = Check::kValue};
  const Assessment horizontal = sources_.position.assess(z, filter);
  apply(horizontal, filter);
  if constexpr (Watch::kWatches)  // a gate that no innovation passes: the hypotheses alone see the fix
    if (horizontal.verdict == sensor::Verdict::kRejected && !horizontal.fuses())
      static_cast<void>(static_cast<nav::Ins&>(ins_).update(fix, -1.0F, watch_.bank()));
  if (!horizontal.fuses()) return record_of(horizontal);
  if (horizontal.action == Action::kResetPosition) sources_.height.reset();
  const Assessment vertical = sources_.height.assess(z, filter);
  apply(vertical, filter);
  return update_by_fix(fix, z, vertical.fuses(), filter);
}

/// One update by a fix, with its height or without.
template <class Watch>
[[gnu::noinline]] Innovation InertialWith<Watch>::update_by_fix(model::GnssFix3d& fix, const FixMeasurement& z,
                                                                bool with_height, const FilterView& filter) {
  const param::GnssParameters& n = filter.parameters().gnss;
  Innovation fused{
      .verdict = sensor::Verdict::kAccepted, .dof = 3, .nis = z.statistics.joint_nis, .gate = fix_gate(n, 3)};
  const float inflation = sources_.position.correlated_inflation(filter);
  fix.sigma_horizontal_m *= base::sqrt(inflation);
  fix.sigma_vertical_m *= base::sqrt(inflation);
  if (!with_height) {
    const float up_m = filter.level().up_n.dot(z.nu);  // to where the filter expects it, and hardly any weight
    nav::move(fix.x, -up_m * filter.level().up_n(0));
    nav::move(fix.y, -up_m * filter.level().up_n(1));
    nav::move(fix.z, -up_m * filter.level().up_n(2));
    fix.sigma_vertical_m = FixMeasurement::kNoHeight_m;
    fused.dof = 2;
    fused.nis = z.statistics.horizontal_nis;
    fused.gate = fix_gate(n, 2);
  }
  const std::array<base::Anchored, 2> was{ins_.x.x, ins_.x.y};
  const auto result = update(fix, base::kInfinity);
  if (result.verdict != filter::Verdict::kAccepted) return estimators::record(result);
  sources_.position.fused(filter.stamp(), nav::difference(ins_.x.x, was[0]), nav::difference(ins_.x.y, was[1]));
  return fused;
}

template <class Watch>
Innovation InertialWith<Watch>::fuse(const sensor::GnssVelocity& velocity, base::Micros stamp, const Context& ctx) {
  const param::GnssParameters& n = ctx.parameters.gnss;
  VelocityMeasurement z = GnssVelocitySource::measurement(velocity, level_, n);
  if (!tracking()) {
    alignment_.velocity(z.v_n_mps, z.sigma_mps, z.has_climb, heading_monitor_, ctx.parameters);
    return {.verdict = sensor::Verdict::kAccepted};
  }
  const FilterView filter = view(stamp, ctx);
  if (!sources_.velocity.continuing_conditions(filter))
    return {.verdict = sensor::Verdict::kStale, .failed = Check::kFrozen};
  z.v_n_mps -= ins_.accel_n_mps2 * filter.later_s();  // to the time of the last IMU sample, as the state is
  if (!z.has_climb)                                   // as expected, and hardly any weight
    z.v_n_mps -= level_.up_n.dot(z.v_n_mps - ins_.x.v_n_mps) * level_.up_n;
  z.v_b_mps = filter.axle_mps(z.v_n_mps);
  compare_with_ground(z, filter);
  heading_monitor_.fuse_velocity(z.v_n_mps, z.sigma_mps, n);
  if (filter.wheels_timed_out() ? heading_monitor_.heading_wrong(filter)
                                : heading_monitor_.direction_wrong(z.v_b_mps, z.level_mps(), z.sigma_mps,
                                                                   sources_.velocity.step_detected(), filter)) {
    restart_filter(stamp, sensor::ResetCause::kHeadingWrong, ctx);
    return {.verdict = sensor::Verdict::kRejected, .failed = Check::kHeading};
  }
  const model::GnssVelocity3d model = GnssVelocitySource::model(z, filter);
  const float gate_scale = GnssVelocitySource::gate_scale(z, n);
  Innovation record = measure(model, sources_.velocity, gate_scale, filter);
  if (!z.has_climb && record.dof == 3) record.dof = 2;
  return record;
}

/// GNSS velocity judges wheels and standstill. A leap that the IMU did not feel is the receiver's, and so is a motion
/// while encoders and IMU stand. An unknown heading turns forward speed into sideways speed: its variance counts here.
template <class Watch>
[[gnu::noinline]] void InertialWith<Watch>::compare_with_ground(const VelocityMeasurement& z,
                                                                const FilterView& filter) {
  standstill_.update_ground(z.v_n_mps);
  sources_.velocity.note(z, filter);
  if (sources_.velocity.step_detected() || (ins_.stands && filter.wheels_agree())) return;
  const float off2 = nav::Vector3(z.v_n_mps - ins_.x.v_n_mps).squaredNorm();
  const float v2 = z.v_n_mps(0) * z.v_n_mps(0) + z.v_n_mps(1) * z.v_n_mps(1);
  const float yaw2 = filter.heading_rad2();
  const float sigma = base::sqrt(z.sigma_mps * z.sigma_mps + v2 * yaw2 * yaw2);
  if (sources_.wheels.contradicted_by_ground(z.v_b_mps(0), sources_.forward.last_mps(), sigma, filter.stamp(),
                                             filter.parameters().inertial))
    Recovery::inflate_motion(ins_, base::sqrt(off2), 0.0F);
}

}  // namespace tetap::estimators
