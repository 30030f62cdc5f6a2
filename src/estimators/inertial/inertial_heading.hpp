// SPDX-License-Identifier: Apache-2.0
// Inertial navigation, part: headings from outside, and from a magnetometer.
#pragma once

#include "estimators/inertial/inertial.hpp"
#include "estimators/inertial/inertial_measure.hpp"
#include "model/dual_heading.hpp"
#include "model/magnetic_heading.hpp"

namespace tetap::estimators {

inline Innovation Inertial::fuse(const sensor::OutsideHeading& heading, base::Micros stamp, const Context& ctx) {
  const float own = base::is_finite(heading.acc_rad) ? heading.acc_rad : 0.1F;
  const float sigma = own > 0.005F ? own : 0.005F;
  const param::GnssParameters& n = ctx.parameters.gnss;
  if (!base::is_finite(heading.yaw_rad)) return {.verdict = sensor::Verdict::kNotFinite};
  if (headings_.hear({heading.yaw_rad}, n.heading_stuck_samples, stamp)) return {.verdict = sensor::Verdict::kStale};
  const nav::Vector3 baseline_b_m{n.baseline_b_m[0], n.baseline_b_m[1], n.baseline_b_m[2]};
  if (phase_ != Phase::kTracking) {
    const nav::Vector3 line = start_.attitude().rotate(baseline_b_m);
    const float yaw_rad = heading.yaw_rad - base::atan2(line(1), line(0)) + nav::euler(start_.attitude()).yaw_rad;
    start_.heading(base::wrap_angle(yaw_rad), sigma);
    return {.verdict = sensor::Verdict::kAccepted};
  }
  // To the time of the last IMU sample, as the state is.
  const float turn_radps = ins_.x.q_nb.rotate(rate_b_radps_ - ins_.x.b_g_radps)(2);
  const float yaw_rad = base::wrap_angle(heading.yaw_rad - turn_radps * later_s(stamp));
  const model::DirectionMeasurement direction = model::DualHeading(baseline_b_m, yaw_rad, sigma);
  return measure(direction, kHeadings, n.gate_scale, stamp, ctx);
}

[[gnu::noinline]] inline bool Inertial::take_heading(const SetPose& given) {
  constexpr float kSmall_rad = 0.3F;  // what is turned further than that no linear step turns rightly
  if (!(ins_.p(8, 8) < kSmall_rad * kSmall_rad)) return false;
  const model::DirectionMeasurement ahead =
      model::DualHeading({1.0F, 0.0F, 0.0F}, given.pose.yaw_rad, given.sigma_yaw_rad);
  return update(ahead, filter::chi_square_99(1)).verdict == filter::Verdict::kAccepted;
}

/// The errors of a magnetometer last, so its headings never make the filter's better than sigma_rad: each is given the
/// variance that would end there. While the heading is better known already, they are compared and nothing more.
[[gnu::noinline]] inline Innovation Inertial::fuse(const sensor::MagneticFlux& flux, base::Micros stamp,
                                                   const Context& ctx) {
  const param::MagneticParameters& n = ctx.parameters.magnetic;
  if (n.use == 0 || phase_ == Phase::kWaiting) return {};
  // In the body's axes at the state's time, that of the last IMU sample.
  const bool tracking = phase_ == Phase::kTracking;
  const nav::Vector3 rate = tracking ? nav::Vector3(rate_b_radps_ - ins_.x.b_g_radps) : rate_b_radps_;
  const nav::Vector3 shown = field_b_uT(flux, n);
  const nav::Vector3 field = shown + nav::cross(rate * base::seconds(stamp - time_), shown);
  const nav::Vector3 field_n = (tracking ? ins_.x.q_nb : start_.attitude()).rotate(field);
  const float horizontal2 = field_n(0) * field_n(0) + field_n(1) * field_n(1);
  if (!(horizontal2 > 0.0F && field.squaredNorm() < 1e12F)) return {.verdict = sensor::Verdict::kNotFinite};
  const bool moving = tracking && (ins_.x.v_n_mps.squaredNorm() > 0.25F || rate.squaredNorm() > 0.04F);
  // At rest a good one shows the same for long.
  if (fluxes_.hear(flux.flux_b_uT, moving ? n.stuck_samples : 0, stamp)) return {.verdict = sensor::Verdict::kStale};
  const float off = field_.step({.horizontal_uT = base::sqrt(horizontal2), .up_uT = field_n(2)}, moving, stamp, n);
  if (field_.renewed()) say(sensor::ResetCause::kMagneticField);
  if (!(off <= 1.0F)) return {.verdict = sensor::Verdict::kRejected, .dof = 2, .nis = off, .gate = 1.0F};

  model::DirectionMeasurement direction = model::MagneticHeading(field, n.declination_rad, n.sigma_rad);
  if (!tracking) {
    if (!field_.believed()) return {};
    start_.field(field_n, direction.angle_rad, n.sigma_rad);
    return {.verdict = sensor::Verdict::kAccepted};
  }
  const auto at = direction.linearised(ins_.x);
  const float nu = direction.residual(at.z_hat)(0);
  float p = 0, with_yaw = 0;  // of the direction; of it with the heading
  for (int c = 0; c < 3; ++c) {
    float column = 0;
    for (int r = 0; r < 3; ++r) column += at.h(0, r) * ins_.p(6 + r, 6 + c);
    p += column * at.h(0, c);
    with_yaw = column;
  }
  const float floor = n.sigma_rad * n.sigma_rad;
  const float gate = n.gate_scale * filter::chi_square_99(1);
  Innovation result{.verdict = sensor::Verdict::kAccepted, .dof = 1, .nis = nu * nu / (p + floor), .gate = gate};
  if (!(result.nis < 1e30F)) return {.verdict = sensor::Verdict::kNotFinite};  // a field straight down
  const base::Micros after{ctx.parameters.recovery.after_us};
  // Of a robot without wheels how it moves judges the magnetometer, too: one that is wrong all the time leads the
  // filter's heading, which then agrees with it.
  const bool judged = alone(stamp) && stamp - last_position_ < after;
  const float yaw_rad = nav::euler(ins_.x.q_nb).yaw_rad;
  const float sigmas = judged ? start_.contradicts(yaw_rad + nu, n.sigma_rad) : 0.0F;
  if (sigmas > 0.0F) {
    result.nis = sigmas * sigmas;
    result.gate = Alignment::kSigmas * Alignment::kSigmas;
  }
  const bool agrees = sigmas <= 0.0F && result.nis <= gate;
  if (field_.lasts(agrees, stamp, after)) {
    // With GNSS the filter's heading is the better one. Without, nothing else says where north is.
    if (agrees || stamp - last_position_ < after) {
      field_.believe(agrees, stamp);
    } else {
      ins_.p(8, 8) += nu * nu;
      field_.believe(true, stamp);
      say(sensor::ResetCause::kMagneticField);
    }
  }
  if (!agrees) result.verdict = sensor::Verdict::kRejected;
  if (agrees && !field_.believed()) result.verdict = sensor::Verdict::kNotUsed;
  constexpr float kWorth = 1.05F;  // of its variance the heading has to be off, for an update to change anything
  const float p_yaw = ins_.p(8, 8);
  if (result.verdict == sensor::Verdict::kAccepted && p_yaw > kWorth * floor) {
    const float ends_there = with_yaw * with_yaw / (p_yaw - floor) - p;
    direction.sigma_rad = base::sqrt(ends_there > floor ? ends_there : floor);
    static_cast<void>(update(direction, base::kInfinity));
  }
  return result;
}

}  // namespace tetap::estimators
