// SPDX-License-Identifier: Apache-2.0
// Inertial navigation, part: GNSS position and velocity. A fix is judged by the receiver's own accuracy and weighed by
// how long its errors last; what follows from refusing it is in fix_trust.hpp.
#pragma once

#include "estimators/inertial/inertial.hpp"
#include "estimators/inertial/inertial_measure.hpp"
#include "model/gnss_fix_3d.hpp"
#include "model/gnss_velocity_3d.hpp"

namespace tetap::estimators {

/// The sigma of a height that is not there.
inline constexpr float kNoHeight_m = 1e3F;
/// The same of a vertical speed: NMEA has none.
inline constexpr float kNoClimb_mps = 1e3F;

/// Normalised innovation squared of a fix: of all of it, and of its horizontal part alone.
struct FixNis {
  float joint = base::kNan;
  float level = base::kNan;
  std::array<float, 2> expected_m2{};  ///< variances to east and north of where the filter expects the antenna
};

/// S = H P H^T + R = L L^T, y = L^-1 nu: with up last, the horizontal part's NIS is on the way to the joint one. H is
/// (1 A) over position and attitude, A v = v x lever.
[[gnu::noinline]] inline FixNis nis_of(const nav::Ins::Covariance& p, const nav::Vector3& lever_n_m,
                                       const nav::Vector3& nu, const nav::Vector3& r) {
  constexpr int kTilt = model::GnssFix3d::kTouches[3];
  const auto tilt_with = [&p](int c) { return nav::Vector3(p(kTilt, c), p(kTilt + 1, c), p(kTilt + 2, c)); };
  std::array<nav::Vector3, 3> rows;  // of A P over attitude, then of A times its transpose
  for (int c = 0; c < 3; ++c) {
    const nav::Vector3 column = nav::cross(tilt_with(kTilt + c), lever_n_m);
    for (int i = 0; i < 3; ++i) rows[static_cast<std::size_t>(i)](c) = column(i);
  }
  nav::Matrix3 s;
  for (int i = 0; i < 3; ++i) {
    const nav::Vector3 own = nav::cross(rows[static_cast<std::size_t>(i)], lever_n_m);
    for (int j = 0; j <= i; ++j) s(i, j) = p(i, j) + own(j);
  }
  for (int c = 0; c < 3; ++c) {
    const nav::Vector3 seen = nav::cross(tilt_with(c), lever_n_m);  // row, with the position's column c
    for (int i = 0; i < 3; ++i) {
      if (i >= c) s(i, c) += seen(i);
      if (i <= c) s(c, i) += seen(i);
    }
  }
  nav::Matrix3 l;
  nav::Vector3 y;
  FixNis nis{.expected_m2 = {s(0, 0), s(1, 1)}};
  float sum = 0;
  for (int i = 0; i < 3; ++i) {
    y(i) = nu(i);
    for (int j = 0; j <= i; ++j) {
      float rest = i == j ? s(i, i) + r(i) : s(i, j);
      for (int k = 0; k < j; ++k) rest -= l(i, k) * l(j, k);
      if (j < i) {
        l(i, j) = rest / l(j, j);
        y(i) -= l(i, j) * y(j);
      } else {
        if (!(rest > 0.0F)) return {};
        l(i, i) = base::sqrt(rest);
        y(i) /= l(i, i);
      }
    }
    sum += y(i) * y(i);
    if (i == 1) nis.level = sum;
  }
  nis.joint = sum;
  return nis;
}

inline Innovation Inertial::fuse(const sensor::GnssPosition& fix, base::Micros stamp, const Context& ctx) {
  const param::GnssParameters& n = ctx.parameters.gnss;
  work_left_ -= kOfAFix;
  if (fix.fix < sensor::GnssFix::k2d || ctx.map_frame.origin == sensor::OriginSource::kNone) return {};
  const bool has_height = base::is_finite(fix.height_m);
  const nav::Local local = ctx.map_frame.frame.to_local(fix.latitude_2ndeg, fix.longitude_2ndeg,
                                                        has_height ? fix.height_m : ctx.map_frame.frame.height_m());
  if (!local.valid) return {.verdict = sensor::Verdict::kNotFinite};
  const auto sigma = [&n](float own, float otherwise) {
    const float scaled = base::is_finite(own) ? n.sigma_scale * own : otherwise;
    return scaled > n.sigma_floor_m ? scaled : n.sigma_floor_m;
  };
  model::GnssFix3d model{.x = base::Anchored::from_um(local.east_um),
                         .y = base::Anchored::from_um(local.north_um),
                         .z = base::Anchored::from_um(local.up_um),
                         .sigma_horizontal_m = sigma(fix.horizontal_acc_m, 10.0F),
                         .sigma_vertical_m = has_height ? sigma(fix.vertical_acc_m, 20.0F) : kNoHeight_m,
                         .antenna_b_m = {n.antenna_x_b_m, n.antenna_y_b_m, n.antenna_z_b_m}};
  if (phase_ != Phase::kTracking) {
    if (!first_fixes_.hear(fix, stamp, ctx.parameters.recovery.confirm_fixes)) return {};
    start_.fix(model, stamp, ctx.parameters);
    last_position_ = stamp;
    return {.verdict = sensor::Verdict::kAccepted};
  }
  // The fix is true at its own time, the state at that of the last IMU sample: moved by the velocity in between.
  const float later_s = base::seconds(stamp - time_);
  nav::move(model.x, -ins_.x.v_n_mps(0) * later_s);
  nav::move(model.y, -ins_.x.v_n_mps(1) * later_s);
  nav::move(model.z, -ins_.x.v_n_mps(2) * later_s);
  if (frozen_.hear(fix, nav::difference(model.x, ins_.x.x), nav::difference(model.y, ins_.x.y),
                   ctx.parameters.recovery.frozen_m))
    return {.verdict = sensor::Verdict::kStale};
  start_.watch(model);
  if (alone(stamp) && contradicted(stamp, ctx)) {
    begin_anew(stamp, sensor::ResetCause::kHeadingWrong, ctx);
    return {.verdict = sensor::Verdict::kRejected};
  }
  return weigh(model, stamp, ctx);
}

/// A fix decides where the filter is when the filter's variance is so many times that of the fix.
inline constexpr float kDecides = 4.0F;

/// The joint gate; where it fails, that of the horizontal part alone. A fix that would decide where the filter is has
/// to be confirmed by others; one that is refused may persist.
[[gnu::noinline]] inline Innovation Inertial::weigh(model::GnssFix3d& fix, base::Micros stamp, const Context& ctx) {
  const param::RecoveryParameters& rules = ctx.parameters.recovery;
  const param::GnssParameters& n = ctx.parameters.gnss;
  ins_.predict_covariance();
  const auto at = fix.linearised(ins_.x);
  const nav::Vector3 nu = -at.z_hat, r = fix.noise();
  const FixNis nis = nis_of(ins_.p, {at.h(1, 5), -at.h(0, 5), at.h(0, 4)}, nu, r);
  if (!(nis.joint < 1e30F && r(0) < 1e12F && r(2) < 1e12F)) return {.verdict = sensor::Verdict::kNotFinite};
  bool whole = nis.joint <= n.gate_scale * filter::chi_square_99(3);
  bool level = whole || nis.level <= n.gate_scale * filter::chi_square_99(2);
  Innovation record{.verdict = sensor::Verdict::kAccepted,
                    .dof = 3,
                    .nis = nis.joint,
                    .gate = n.gate_scale * filter::chi_square_99(3)};
  if (level && drifts(nu, r, nis, n, record)) whole = level = false;
  refused_or_not(kPosition, !level, stamp);

  if (!level || ins_.p(0, 0) + ins_.p(1, 1) > 2.0F * kDecides * r(0)) {
    record.verdict = level ? sensor::Verdict::kNotUsed : sensor::Verdict::kRejected;
    if (!believe(nu, r, level, stamp, rules)) return record;
    record.verdict = sensor::Verdict::kAccepted;
    drift_.forget();  // the filter is not where they said that it is off
  }
  place_.forget();

  bool height = whole;
  refused_or_not(kHeight, !height, stamp);
  if (!whole || ins_.p(2, 2) > kDecides * r(2)) {
    height_.hear(stamp, nu(2), 0.0F, r(2), ins_.p(2, 2));
    height = whole ? height_.confirmed(rules.confirm_fixes) : height_.persisted(rules.persist_us, rules.persist_fixes);
    if (height && !whole) {
      step(2, 1, {0.0F, 0.0F, height_.east_m()}, r);
      back_ = false;
    }
  }
  if (height) height_.forget();

  const float more =
      n.correlation_s > 0.0F
          ? checks::kColouredNoiseInflation * checks::repeated(base::seconds(stamp - last_position_), n.correlation_s)
          : 1.0F;
  fix.sigma_horizontal_m *= base::sqrt(more);
  fix.sigma_vertical_m *= base::sqrt(more);
  if (!height) {                    // the horizontal part alone
    nav::move(fix.z, at.z_hat(2));  // says what is expected, and hardly anything
    fix.sigma_vertical_m = kNoHeight_m;
    record.dof = 2;
    record.nis = nis.level;
    record.gate = n.gate_scale * filter::chi_square_99(2);
  }
  const base::Anchored was[2]{ins_.x.x, ins_.x.y};
  const auto result = update(fix, base::kInfinity);
  if (result.verdict != filter::Verdict::kAccepted) return estimators::record(result);
  last_position_ = stamp;
  recoveries_ = 0;
  led_m_ = {0.9F * led_m_[0] + nav::difference(ins_.x.x, was[0]), 0.9F * led_m_[1] + nav::difference(ins_.x.y, was[1])};
  doubted_ = false;
  return record;
}

/// Whether the fixes drift away, as far as their errors are new with each: those that last wander themselves. What is
/// said of it is the drift's NIS, not that of the one fix.
[[gnu::noinline]] inline bool Inertial::drifts(const nav::Vector3& nu, const nav::Vector3& r, const FixNis& of_fix,
                                               const param::GnssParameters& n, Innovation& record) {
  if (n.correlation_s > 0.0F) return false;
  drift_.hear(nu(0), nu(1));
  const float nis = drift_.nis(r(0), of_fix.expected_m2[0], of_fix.expected_m2[1]);
  const float gate = n.gate_scale * checks::kChiSquare999Of2;
  if (!drift_.vouched_for() || nis <= gate) return false;
  record.dof = 2;
  record.nis = nis;
  record.gate = gate;
  return true;
}

/// Of a fix that is refused, or (`agrees`) would decide where the filter is: whether it is to be believed now.
[[gnu::noinline]] inline bool Inertial::believe(const nav::Vector3& nu, const nav::Vector3& r, bool agrees,
                                                base::Micros stamp, const param::RecoveryParameters& rules) {
  const float p_level = ins_.p(0, 0) + ins_.p(1, 1);
  // A filter that refuses fixes may have moved otherwise than it thinks by as much as it doubts in any direction (twice
  // the least eigenvalue): one that is held to a line is wrong across it, however little it knows along it.
  const float half = 0.5F * (ins_.p(0, 0) - ins_.p(1, 1)), both = ins_.p(0, 1);
  const float longer = agrees ? 0.0F : 2.0F * base::sqrt(half * half + both * both);
  place_.hear(stamp, nu(0), nu(1), r(0), p_level - longer);
  const bool confirmed = place_.confirmed(rules.confirm_fixes);
  if (agrees) return confirmed;
  if (confirmed && !doubted_) {  // the fixes before may have begun to lead it away
    for (int i = 0; i < 2; ++i)
      ins_.p(i, i) += led_m_[static_cast<std::size_t>(i)] * led_m_[static_cast<std::size_t>(i)];
    doubted_ = true;
  }
  // Back to where a jump came from: dead reckoning before it and fixes after it say the same.
  const bool back = confirmed && back_ && place_.says(-jump_.east_m, -jump_.north_m, 2.0F * r(0) + p_level);
  // Fixes that agree with nothing for very long: the filter is no judge of how it moves. Sooner where nothing but its
  // IMU says so, and what the fixes claim is not a jump that lasts.
  const base::Micros refused = stamp - refused_[kPosition].since;
  const bool told = !alone(stamp) || (ground_.us > 0 && stamp - ground_ < base::Micros{1'000'000});
  const base::Micros despair{4 * std::int64_t{told ? rules.persist_us : rules.after_us}};
  const bool lost =
      confirmed && refused >= despair && (told || !place_.persisted(static_cast<std::int32_t>(refused.us / 2), 0));
  if (!back && !lost && !place_.persisted(rules.persist_us, rules.persist_fixes)) return false;
  step(0, 2, {place_.east_m(), place_.north_m(), 0.0F}, r);
  if (lost && !told) {  // so it moved otherwise than it thought, all that time
    const float way2_m2 = place_.east_m() * place_.east_m() + place_.north_m() * place_.north_m();
    doubt(base::sqrt(way2_m2) / base::seconds(refused), 0.0F);
  }
  ins_.p(8, 8) += rules.inflate_yaw_rad * rules.inflate_yaw_rad;
  height_.forget();
  refused_[kPosition] = {};
  back_ = !back;
  return true;
}

/// The coordinates from `first` on are where fixes have been for long, and as uncertain as a fix.
[[gnu::noinline]] inline void Inertial::step(int first, int count, const nav::Vector3& by_m,
                                             const nav::Vector3& variance_m2) {
  const std::array<base::Anchored*, 3> coordinates{&ins_.x.x, &ins_.x.y, &ins_.x.z};
  for (int i = first; i < first + count; ++i) {
    nav::move(*coordinates[static_cast<std::size_t>(i)], by_m(i));
    for (int k = 0; k < nav::Ins::kErrors; ++k) ins_.p(i, k) = 0;
    ins_.p(i, i) = variance_m2(i);
  }
  ins_.recondition();
  corrected();
  jump_ = {.east_m = by_m(0), .north_m = by_m(1), .up_m = by_m(2), .count = static_cast<std::uint8_t>(jump_.count + 1)};
}

/// Receiver and wheels have agreed for long on a speed, but not on where it goes: nothing drives half a radian
/// sideways, so the filter looks another way than it believes.
[[gnu::noinline]] inline bool Inertial::looks_wrong(const nav::Vector3& v_b_mps, float level_mps, float sigma_mps,
                                                    base::Micros stamp, const Context& ctx) {
  constexpr float kCosine = 0.88F;
  const float rolled = stamp - rolled_ < base::Micros{500'000} ? rolled_mps_ : 0.0F;
  const float ahead = rolled < 0.0F ? -v_b_mps(0) : v_b_mps(0);
  const bool wrong = level_mps > 4.0F * sigma_mps + 0.3F &&
                     base::abs(level_mps - base::abs(rolled)) < 3.0F * sigma_mps + 0.05F * level_mps &&
                     ahead < kCosine * level_mps - sigma_mps;
  return wrong_for_long(wrong, stamp, ctx.parameters.recovery);
}

/// Of a robot without wheels: how it moves has shown for long another heading than the filter's. Where a magnetometer
/// that is no longer believed may have led it, velocities alone do not pull it round: the filter is too sure for that.
[[gnu::noinline]] inline bool Inertial::contradicted(base::Micros stamp, const Context& ctx) {
  constexpr float kLed_rad = 0.1F, kLed = 3.0F;
  const float yaw_rad = nav::euler(ins_.x.q_nb).yaw_rad, sigma_rad = base::sqrt(heading_rad2());
  const float sigmas = field_.misleads(stamp) ? start_.contradicts(yaw_rad, sigma_rad, kLed_rad, kLed)
                                              : start_.contradicts(yaw_rad, sigma_rad);
  return wrong_for_long(sigmas > 0.0F, stamp, ctx.parameters.recovery);
}

inline bool Inertial::wrong_for_long(bool wrong, base::Micros stamp, const param::RecoveryParameters& rules) {
  constexpr base::Micros kLately{2'500'000};
  if (!wrong || stamp - wrong_way_at_ > kLately) wrong_way_ = {};
  if (!wrong) return false;
  if (wrong_way_.in_a_row++ == 0) wrong_way_.since = stamp;
  wrong_way_at_ = stamp;
  return wrong_way_.in_a_row >= rules.at_least && stamp - wrong_way_.since >= base::Micros{rules.after_us};
}

inline Innovation Inertial::fuse(const sensor::GnssVelocity& velocity, base::Micros stamp, const Context& ctx) {
  const param::GnssParameters& n = ctx.parameters.gnss;
  nav::Vector3 v_n{velocity.v_n_mps[0], velocity.v_n_mps[1], velocity.v_n_mps[2]};
  const bool has_climb = base::is_finite(v_n(2));
  const float own = base::is_finite(velocity.acc_mps) ? velocity.acc_mps : 0.5F;
  const float sigma = own > n.sigma_velocity_floor_mps ? own : n.sigma_velocity_floor_mps;
  if (phase_ != Phase::kTracking) {
    start_.velocity(v_n, sigma, has_climb, ctx.parameters);
    return {.verdict = sensor::Verdict::kAccepted};
  }
  if (frozen_.frozen()) return {.verdict = sensor::Verdict::kStale};
  v_n -= ins_.accel_n_mps2 * later_s(stamp);   // to the time of the last IMU sample, as the state is
  if (!has_climb) v_n(2) = ins_.x.v_n_mps(2);  // says what is expected, and hardly anything
  const nav::Vector3 v_b = axle_mps(v_n, ctx);
  hear_ground(v_n, v_b, sigma, stamp, ctx);
  // A receiver and a filter that say another direction: either may be wrong, and the filter gives way after a while.
  // Another speed than that which wheels agree with: the receiver is.
  const float level = base::sqrt(v_b(0) * v_b(0) + v_b(1) * v_b(1)), rolled = base::abs(forward_mps());
  if (wheels_agree(stamp, ctx) && base::abs(level - rolled) > 4.0F * sigma + 0.2F * rolled + 0.5F)
    refused_[kVelocity].since = stamp;
  start_.watch(v_n, sigma, n);
  if (alone(stamp) ? contradicted(stamp, ctx) : looks_wrong(v_b, level, sigma, stamp, ctx)) {
    begin_anew(stamp, sensor::ResetCause::kHeadingWrong, ctx);
    return {.verdict = sensor::Verdict::kRejected};
  }
  const float gate = has_climb ? 1.0F : filter::chi_square_99(2) / filter::chi_square_99(3);
  Innovation record = measure(model::GnssVelocity3d{.v_n_mps = v_n,
                                                    .sigma_horizontal_mps = sigma,
                                                    .sigma_vertical_mps = has_climb ? 1.5F * sigma : kNoClimb_mps,
                                                    .antenna_b_m = {n.antenna_x_b_m, n.antenna_y_b_m, n.antenna_z_b_m},
                                                    .gyro_b_radps = rate_b_radps_},
                              kVelocity, gate * n.gate_scale, stamp, ctx);
  if (!has_climb && record.dof == 3) record.dof = 2;
  drift_.velocity(record.verdict == sensor::Verdict::kAccepted);
  return record;
}

}  // namespace tetap::estimators
