// SPDX-License-Identifier: Apache-2.0
// Inertial navigation, part: wheels, with the non-holonomic constraint.
#pragma once

#include "base/math.hpp"
#include "estimators/inertial/inertial.hpp"
#include "estimators/inertial/inertial_measure.hpp"
#include "model/wheel_speed.hpp"

namespace tetap::estimators {

inline Innovation Inertial::fuse(const sensor::WheelCounts& counts, base::Micros stamp, const Context& ctx) {
  const auto& drive = ctx.parameters.wheels.drive;
  const base::Micros interval = stamp - counts_time_;
  if (counts_soon(stamp, ctx)) {
    if (counts.left != counts_.left || counts.right != counts_.right) moved_ = stamp;
    return {.verdict = sensor::Verdict::kAccepted};
  }
  const bool usable = have_counts_ && interval.us > 0 && interval <= base::Micros{ctx.parameters.wheels.timeout_us};
  const std::int32_t left = model::count_difference(counts.left, counts_.left);
  const std::int32_t right = model::count_difference(counts.right, counts_.right);
  counts_ = counts;
  counts_time_ = stamp;
  have_counts_ = true;
  if (!usable || left != 0 || right != 0) moved_ = stamp;
  // Counts are the mean over the interval, the state is at its end: half of what it gained in between is added. By the
  // IMU, for what measurements corrected meanwhile was not gained.
  const float later_mps = base::is_finite(gained_mps_) ? 0.5F * gained_mps_ : 0.0F;
  gained_mps_ = 0;
  if (!usable) return {.verdict = sensor::Verdict::kAccepted};
  const float per_s = 1.0F / base::seconds(interval);
  const checks::WheelSlip::Wheels wheels{.left_mps = drive.left_m(left) * per_s,
                                         .right_mps = drive.right_m(right) * per_s};
  // One count over the interval; and what slip and radii make of the way since, as odometry has it (noise in m^2 per
  // m). The way is the filter's: by the counts', those that err to the slow side would count for more.
  const float count_mps = 0.41F * drive.left_m(1) * per_s;
  const bool tracking = phase_ == Phase::kTracking;
  const float mean_mps = tracking ? forward_mps() : 0.5F * (wheels.left_mps + wheels.right_mps);
  const float half_mps = tracking ? 0.5F * drive.track_m * (rate_b_radps_(2) - ins_.x.b_g_radps(2))
                                  : 0.5F * (wheels.right_mps - wheels.left_mps);
  const float way =
      drive.noise_left * base::abs(mean_mps - half_mps) + drive.noise_right * base::abs(mean_mps + half_mps);
  return roll(wheels, base::sqrt(count_mps * count_mps + 0.25F * way * per_s), later_mps, stamp, ctx);
}

inline Innovation Inertial::fuse(const sensor::WheelSpeeds& speeds, base::Micros stamp, const Context& ctx) {
  if (speed_soon(stamp, ctx)) return {.verdict = sensor::Verdict::kAccepted};
  return roll({.left_mps = speeds.left_mps, .right_mps = speeds.right_mps}, 0.0F, 0.0F, stamp, ctx);
}

/// No wheels to compare: only its gate judges it.
inline Innovation Inertial::fuse(const sensor::BodySpeed& speed, base::Micros stamp, const Context& ctx) {
  if (speed_soon(stamp, ctx)) return {.verdict = sensor::Verdict::kAccepted};
  rolled_mps_ = speed.forward_mps;
  rolled_ = stamp;
  return forward({.mps = speed.forward_mps}, stamp, ctx);
}

/// Two wheels, as far as they roll: their mean; of one that rolls while the other spins, what the gyroscope leaves of
/// it at the middle of the axle; of two that spin nothing.
inline Innovation Inertial::roll(const checks::WheelSlip::Wheels& wheels, float sigma_mps, float later_mps,
                                 base::Micros stamp, const Context& ctx) {
  const param::InertialParameters& n = ctx.parameters.inertial;
  const float track_m = ctx.parameters.wheels.drive.track_m;
  if (!base::is_finite(wheels.left_mps) || !base::is_finite(wheels.right_mps))
    return {.verdict = sensor::Verdict::kNotFinite};
  const float mean = 0.5F * (wheels.left_mps + wheels.right_mps);
  rolled_mps_ = mean;
  rolled_ = stamp;
  if (phase_ != Phase::kTracking || !(track_m > 0)) return forward({.mps = mean, .sigma_mps = sigma_mps}, stamp, ctx);
  // Without a gyroscope the wheels are all that shows turning, and cannot be judged by it.
  const bool gyro = !without_imu();
  const nav::Vector3 w_b = rate_b_radps_ - ins_.x.b_g_radps;
  const nav::Vector3 v_b = ins_.x.q_nb.conjugate().rotate(ins_.x.v_n_mps);
  const float turn = gyro ? track_m * w_b(2) : track_m * wheel_turn_radps_;
  const float worst = ins_.p(3, 3) > ins_.p(4, 4) ? ins_.p(3, 3) : ins_.p(4, 4);
  const auto slip =
      slip_.hear(wheels, {.forward_mps = v_b(0), .sigma_mps = base::sqrt(worst), .turn_mps = turn}, stamp, n);
  if (slip == checks::WheelSlip::Slip::kNone) {
    wheels_ = stamp;
    constexpr float kShare = 0.2F;  // a count is much within one interval, and little over some
    wheel_turn_radps_ += kShare * ((wheels.right_mps - wheels.left_mps) / track_m - wheel_turn_radps_);
    return forward({.mps = mean + later_mps, .sigma_mps = sigma_mps}, stamp, ctx);
  }
  if (slip == checks::WheelSlip::Slip::kBoth) {
    refused_or_not(kWheels, true, stamp);
    // Where GNSS holds the filter's velocity the wheels are wrong; without it, the filter may as well be.
    constexpr base::Micros kLately{1'000'000};
    const bool held =
        stamp - last_position_ <= kLately || (stamp - ground_ <= kLately && refused_[kVelocity].in_a_row == 0);
    if (!held && stamp - refused_[kWheels].since >= base::Micros{ctx.parameters.recovery.after_us}) {
      recover(nav::Vector3(nav::Vector3::Zero()), kWheels, ctx.parameters);
      doubt(mean - v_b(0), 0.0F);
      slip_.forget();
    }
    return {.verdict = sensor::Verdict::kRejected};
  }
  if (!gyro) return {.verdict = sensor::Verdict::kRejected};
  const float one =
      slip == checks::WheelSlip::Slip::kLeft ? wheels.right_mps - 0.5F * turn : wheels.left_mps + 0.5F * turn;
  constexpr float kOne = 1.42F;  // of one wheel, not the mean of two
  const float alone = kOne * n.slip_share * v_b(0);
  return forward({.mps = one + later_mps, .sigma_mps = base::sqrt(2.0F * sigma_mps * sigma_mps + alone * alone)}, stamp,
                 ctx);
}

/// What the receiver says of the middle of the axle, in the body.
inline nav::Vector3 Inertial::axle_mps(const nav::Vector3& v_n_mps, const Context& ctx) const {
  const param::GnssParameters& n = ctx.parameters.gnss;
  const nav::Vector3 antenna_b{n.antenna_x_b_m - ctx.parameters.inertial.axle_x_b_m, n.antenna_y_b_m, n.antenna_z_b_m};
  const nav::Vector3 w_b = rate_b_radps_ - ins_.x.b_g_radps;
  return ins_.x.q_nb.conjugate().rotate(v_n_mps) - nav::cross(w_b, antenna_b);
}

/// GNSS velocity: what the wheels, and standing still, are held against.
[[gnu::noinline]] inline void Inertial::hear_ground(const nav::Vector3& v_n_mps, const nav::Vector3& v_b_mps,
                                                    float sigma_mps, base::Micros stamp, const Context& ctx) {
  if (calm_.us > 0) {
    ++grounds_;
    const auto share = 1.0F / static_cast<float>(grounds_ < 25 ? grounds_ : 25);
    ground_mps_ += (v_n_mps - ground_mps_) * share;
  }
  ground_ = stamp;
  // Wheels that lose grip at once by more than that are seen by the IMU; what only GNSS saw is the receiver's.
  constexpr float kUnseen_mps = 3;
  const float off2 = nav::Vector3(v_n_mps - ins_.x.v_n_mps).squaredNorm();
  if (off2 > kUnseen_mps * kUnseen_mps && wheels_agree(stamp, ctx)) return;
  // A heading that is not known turns speed ahead into speed sideways: its doubt counts here.
  const float v2 = v_n_mps(0) * v_n_mps(0) + v_n_mps(1) * v_n_mps(1);
  const float yaw2 = heading_rad2();
  const float sigma = base::sqrt(sigma_mps * sigma_mps + v2 * yaw2 * yaw2);
  if (slip_.ground(v_b_mps(0), rolled_mps_, sigma, stamp, ctx.parameters.inertial)) doubt(base::sqrt(off2), 0.0F);
}

inline Innovation Inertial::forward(const Forward& speed, base::Micros stamp, const Context& ctx) {
  const param::InertialParameters& n = ctx.parameters.inertial;
  if (phase_ != Phase::kTracking) {
    start_.forward(speed.mps, n.wheel_mps + n.slip_share * base::abs(speed.mps), n.axle_x_b_m);
    return {.verdict = sensor::Verdict::kAccepted};
  }
  constrained_ = stamp;
  const float variance = ins_.p(3, 3) + ins_.p(4, 4) + ins_.p(5, 5);
  // As fast as the filter goes, or may: by the reading, readings that err to the slow side would count for more.
  const nav::Vector3 ahead_n = ins_.x.q_nb.rotated_x();
  const float own_mps = ahead_n.dot(ins_.x.v_n_mps);
  const float slip2 = n.slip_share * n.slip_share * (own_mps * own_mps + variance);
  const float sigma = base::sqrt(n.wheel_mps * n.wheel_mps + slip2 + speed.sigma_mps * speed.sigma_mps);
  // Where wheels say nothing the filter has to be sure that it stands, or goes.
  constexpr float kSure_mps = 0.1F;
  const bool goes = speed.sigma_mps < kUnknown_mps
                        ? base::abs(speed.mps) > 2.0F * n.wheel_mps
                        : variance > kSure_mps * kSure_mps || ins_.x.v_n_mps.squaredNorm() > 9.0F * variance;
  // The reading is true at its own time, the state at that of the last IMU sample.
  return measure(model::WheelSpeed{.forward_mps = speed.mps - ahead_n.dot(ins_.accel_n_mps2) * later_s(stamp),
                                   .sigma_forward_mps = sigma,
                                   .sigma_lateral_mps = n.lateral_mps,
                                   .sigma_vertical_mps = n.vertical_mps,
                                   .axle_b_m = {n.axle_x_b_m, 0.0F, 0.0F},
                                   .gyro_b_radps = rate_b_radps_,
                                   .moves = goes && !ins_.stands},
                 kWheels, n.wheel_gate_scale, stamp, ctx);
}

/// They came of late, do not spin, and the filter goes as fast as they say. Not for ever: it may be pinned to them on a
/// ferry, and fixes that are refused for long are right.
inline bool Inertial::wheels_agree(base::Micros at, const Context& ctx) const {
  const Refused& fixes = refused_[kPosition];
  if (fixes.in_a_row > 0 && at - fixes.since >= base::Micros{ctx.parameters.recovery.persist_us}) return false;
  return wheels_.us > 0 && at - wheels_ < base::Micros{1'000'000} && refused_[kWheels].in_a_row == 0 &&
         slip_.slip() == checks::WheelSlip::Slip::kNone;
}

/// A wheel speed of which nothing is known: the non-holonomic constraint is what it leaves.
inline void Inertial::constrain(base::Micros stamp, const Context& ctx) {
  const base::Micros every{ctx.parameters.inertial.constrain_every_us};
  if (every.us <= 0 || stamp - constrained_ < every || stand_waits_ || !can_do(stamp - constrained_, every)) return;
  // Of a start in motion: linearised about a speed and a heading that are both in doubt it leaves out the product of
  // the two doubts. While that is more than the mean of its noise over some samples, what is left out would be taken
  // for a heading.
  constexpr float kMean_s = 0.04F;
  const float lateral = ctx.parameters.inertial.lateral_mps;
  const float mean2 = lateral * lateral * base::seconds(every) / kMean_s;
  speed_known_ = speed_known_ || (ins_.p(3, 3) + ins_.p(4, 4)) * ins_.p(8, 8) < mean2;
  if (!speed_known_) return;
  // That it does not move sideways says nothing for wheels that spin.
  const Refused spinning = refused_[kWheels];
  static_cast<void>(forward({.sigma_mps = kUnknown_mps}, stamp, ctx));
  if (slip_.slip() == checks::WheelSlip::Slip::kBoth) refused_[kWheels] = spinning;
}

}  // namespace tetap::estimators
