// SPDX-License-Identifier: Apache-2.0
// Inertial navigation, part: IMU samples, the begin of tracking, standstill.
#pragma once

#include "estimators/inertial/inertial.hpp"
#include "model/zero_rate.hpp"
#include "model/zero_velocity.hpp"

namespace tetap::estimators {

inline Innovation Inertial::fuse(const sensor::ImuSample& sample, base::Micros stamp, const Context& ctx) {
  const param::InertialParameters& n = ctx.parameters.inertial;
  --work_left_;
  const nav::ImuIncrement increment = mounted(shown_by(sample), n);
  if (increment.check() != nav::ImuVerdict::kAccepted) return {.verdict = sensor::Verdict::kNotFinite};
  const float dt_s = base::seconds(increment.dt);
  const bool was_stuck = imu_.stuck();
  // Whether it is used may have been seen otherwise ahead; and it is no longer what is doubted there.
  if (sample.clipped_gyro > 0 || sample.clipped_accel > 0) corrected();
  if (!imu_.hear(sample, stamp, n)) {
    if (!was_stuck) corrected();
    // Those before it were taken for what they said.
    const float false_s = static_cast<float>(n.stuck_samples) * dt_s;
    if (!was_stuck && phase_ == Phase::kTracking) doubt(n.gap_mps2 * false_s, n.gap_radps * false_s);
    return {.verdict = sensor::Verdict::kStale};
  }
  // At full scale a gyroscope does not show its turn. Where wheels do, it is as if it were not there.
  if (phase_ == Phase::kTracking && sample.clipped_gyro > 0 && turn_known(stamp)) {
    unusable_ = true;
    return {.verdict = sensor::Verdict::kNotUsed};
  }
  // All that was true at the last sample has been fused: wheels bring the constraint with them, and twice is too sure.
  if (phase_ == Phase::kTracking) constrain(time_, ctx);
  rate_b_radps_ = increment.dtheta_b_rad / dt_s;
  if (phase_ != Phase::kTracking) {
    if (stamp - increment.dt - time_ > base::Micros{1'500}) start_.gap(stamp - increment.dt - time_);
    time_ = stamp;
    if (start_.level(increment, n)) phase_ = Phase::kHeading;
    if (phase_ == Phase::kHeading && start_.ready()) begin(ctx);
    return {.verdict = sensor::Verdict::kAccepted};
  }
  // Lost samples: what is missing between the last and the begin of this one is bridged. What was bridged already it
  // does not tell again.
  const base::Micros gap = stamp - increment.dt - time_;
  unusable_ = false;
  if (overlaps(gap, increment.dt)) {
    corrected();
    return {.verdict = sensor::Verdict::kStale};
  }
  if (gap > kImuJitter) {
    const nav::Vector3 shown = rate_b_radps_;
    const base::Micros before = bridged_;
    bridge(gap, ctx);
    if (gap <= base::Micros{n.stale_us}) bridged_ = before;  // a few lost are not an IMU that is
    rate_b_radps_ = shown;
  }
  const nav::Quaternion& q = ins_.x.q_nb;
  const float up_b = 2.0F * (q.x * q.z - q.w * q.y);  // what of gravity's reaction an accelerometer shows forward
  gained_mps_ += increment.dv_b_mps(0) - (ins_.x.b_a_mps2(0) + up_b * ins_.earth.gravity_mps2) * dt_s;
  const nav::ImuVerdict verdict = ins_.predict(increment);
  if (verdict == nav::ImuVerdict::kDiverged)
    begin_anew(stamp, sensor::ResetCause::kDiverged, ctx);  // faster than anything drives
  if (verdict != nav::ImuVerdict::kAccepted) {
    time_ = stamp;
    return {.verdict = sensor::Verdict::kNotFinite};
  }
  // A measurement brings it up to date; where this tick may take one, it is left to that.
  const float every_s = !anew_ ? 20e-3F : one_by_one_ ? 30e-3F : 7.5e-3F;
  ins_.vibration = imu_.noise_factor(n);
  if (ins_.pending_s() >= every_s) ins_.predict_covariance();
  // Clipped increments are used, and are as uncertain as none.
  if (sample.clipped_accel > 0 || sample.clipped_gyro > 0) {
    const float growth = base::sqrt(dt_s * 0.1F);
    if (sample.clipped_accel > 0) ins_.accel_n_mps2 = nav::Vector3::Zero();
    doubt(n.gap_mps2 * growth, sample.clipped_gyro > 0 ? n.gap_radps * growth : 0.0F);
  }
  time_ = stamp;
  if (stamp > ahead_.heard()) corrected();  // it left before the present had it
  still_.s += dt_s;
  still_.rate_radps += (rate_b_radps_ - still_.rate_radps) * (dt_s / (still_.s > dt_s ? still_.s : dt_s));
  stand(stamp, ctx);
  if (alone(stamp)) {
    start_.watch(increment, ins_.x.q_nb);
  } else {
    start_.watch_no_more();
  }
  return {.verdict = sensor::Verdict::kAccepted};
}

/// Velocity and attitude may be off by this, too.
[[gnu::noinline]] inline void Inertial::doubt(float sigma_mps, float sigma_rad) {
  for (int i = 3; i < 6; ++i) {
    ins_.p(i, i) += sigma_mps * sigma_mps;
    ins_.p(3 + i, 3 + i) += sigma_rad * sigma_rad;
  }
}

/// Wheels have said of late how it turns.
inline bool Inertial::turn_known(base::Micros at) const {
  return wheels_.us > 0 && at - wheels_ < base::Micros{200'000} && slip_.slip() == checks::WheelSlip::Slip::kNone;
}

/// The last that the filter went was without IMU.
inline bool Inertial::without_imu() const {
  return imu_.stuck() || unusable_ || (bridged_.us > 0 && bridged_ == time_);
}

/// Goes on without IMU: the velocity stays what it is in the body, which turns as the wheels say, or not at all.
[[gnu::noinline]] inline void Inertial::bridge(base::Micros gap, const Context& ctx) {
  const param::InertialParameters& n = ctx.parameters.inertial;
  const bool wheels = turn_known(time_);
  const float dt_s = base::seconds(gap);
  ins_.predict_without_imu(gap, n.gap_mps2, unseen_turn_radps(n));
  nav::Vector3 w_b = nav::Vector3::Zero();
  if (wheels) {
    w_b(2) = wheel_turn_radps_;
    ins_.turn_without_imu(nav::exp_quaternion(ins_.x.q_nb.rotate(w_b) * dt_s));
    // Both wheels slip by their share, each on its own, for about a second the same.
    const float slip = n.slip_share * n.slip_share * 2.0F * ins_.x.v_n_mps.squaredNorm();
    const float track_m = ctx.parameters.wheels.drive.track_m;
    ins_.p(8, 8) += slip / (track_m * track_m) * dt_s;
  }
  corrected();
  start_.gap(gap);
  rate_b_radps_ = ins_.x.b_g_radps + w_b;
  time_ += gap;
  bridged_ = time_;
  gained_mps_ = base::kNan;
  still_.s = waiting_.s = 0;
  calm_ = {};
}

/// For the status of the present.
inline std::uint16_t Inertial::faults() const {
  std::uint16_t bits = 0;
  const auto raise = [&bits](sensor::Fault fault, bool is) {
    if (is) bits = static_cast<std::uint16_t>(bits | 1U << static_cast<unsigned>(fault));
  };
  raise(sensor::Fault::kWheelSlip, slip_.slip() != checks::WheelSlip::Slip::kNone);
  raise(sensor::Fault::kImuClipped, imu_.clipped_lately(time_));
  raise(sensor::Fault::kVibration, imu_.shaken());
  raise(sensor::Fault::kSensorStuck,
        imu_.stuck() || fluxes_.stuck(time_) || pressures_.stuck(time_) || headings_.stuck(time_));
  raise(sensor::Fault::kInputStale, blind_ && !imu_.stuck() && !unusable_);
  return bits;
}

/// As after power on, but nothing is known of where it is. By how much it steps will be seen when it has begun again:
/// from the last that was published.
[[gnu::noinline]] inline void Inertial::begin_anew(base::Micros t, sensor::ResetCause cause, const Context& ctx) {
  const auto count = static_cast<std::uint8_t>(jump_.count + 1);
  const nav::InsState last = ahead_.present();
  const Alignment before = start_;
  const bool believed = field_.believed();
  base::reinitialise(*this);
  start_.take_over(before);
  // Where how it moves finds the heading once more, a magnetometer that led it astray, or did not keep it from that,
  // has to agree first.
  if (start_.watches() && (!believed || cause == sensor::ResetCause::kHeadingWrong)) field_.believe(false, t);
  time_ = t;
  noise_of(ctx.parameters.inertial);
  ahead_.remember(last);
  jump_ = {.east_m = base::kNan,
           .north_m = base::kNan,
           .up_m = base::kNan,
           .yaw_rad = base::kNan,
           .cause = cause,
           .count = count};
}

/// The filter begins where the start found the robot.
inline void Inertial::begin(const Context& ctx) {
  if (ctx.map_frame.origin != sensor::OriginSource::kNone)
    ins_.earth = nav::Earth::at(ctx.map_frame.frame, ctx.parameters.inertial.earth_rate != 0);
  start_.begin(ins_, ctx.parameters.inertial, phase_ == Phase::kTracking, alone(time_) ? base::kNan : rolled_mps_);
  phase_ = Phase::kTracking;
  speed_known_ = !start_.hears_fixes();
  still_.s = waiting_.s = 0;
  gained_mps_ = base::kNan;
  refused_ = {};
  is_elsewhere();
}
/// Places and heights that were refused were so by where it was believed to be.
inline void Inertial::is_elsewhere() {
  last_position_ = time_;
  refused_[kPosition] = refused_[kHeight] = {};
  work_left_ = 0;     // the covariance is looked at from end to end
  corrected_ = 0xFF;  // and where it is now has to be known at once
}

/// Standing: wheels that have not turned for half a second; without wheels, see resting(). Then there is no velocity,
/// and what the gyroscope shows is its bias. What goes unnoticed at standstill may be the same all the time: it is told
/// only to a filter that knows less, and each mean of the gyroscope has samples of its own.
inline void Inertial::stand(base::Micros stamp, const Context& ctx) {
  const param::InertialParameters& n = ctx.parameters.inertial;
  constexpr base::Micros kQuiet{500'000};
  stand_waits_ = false;
  const bool gyro = !without_imu();
  const nav::Vector3 turn = rate_b_radps_ - ins_.x.b_g_radps;
  if (!gyro || !imu_.calm(n)) {
    calm_ = {};
  } else if (calm_.us == 0) {
    calm_ = stamp;
    grounds_ = 0;
  }
  const bool wheels = have_counts_ && stamp - counts_time_ < kStandEvery;
  const bool quiet =
      wheels ? stamp - moved_ > kQuiet && slip_.slip() == checks::WheelSlip::Slip::kNone : resting(stamp, ctx);
  ins_.stands = quiet && turn.squaredNorm() <= n.still_radps * n.still_radps;
  if (!ins_.stands) {
    still_.s = waiting_.s = 0;
    stood_ = stamp - kStandEvery;
    return;
  }
  const auto gate = [](int dof) { return filter::chi_square_99(dof) * 4.0F; };
  const float sigma = wheels ? n.still_mps : n.still_gnss_mps;
  const float least = sigma * sigma;
  if (stamp - stood_ >= kStandEvery) {
    if (!(ins_.p(3, 3) > least || ins_.p(4, 4) > least || ins_.p(5, 5) > least)) {
      stood_ = stamp;
    } else if (can_do(stamp - stood_, kStandEvery)) {
      stood_ = stamp;
      static_cast<void>(update(model::ZeroVelocity{.sigma_mps = sigma}, gate(3)));
    } else {
      stand_waits_ = true;
    }
  }
  // A turn of less than one count is not seen at once: a mean is told when standing has lasted a little longer.
  constexpr float kMean_s = 0.5F, kLonger_s = 0.25F;
  if (still_.s < kLonger_s || !gyro) return;
  if (waiting_.s > 0.0F) {
    if (work_left_ < kMeasurement && still_.s < kMean_s) {
      stand_waits_ = true;
      return;
    }
    hold_heading(gate(3), n);
    waiting_.s = 0;
  } else if (still_.s >= kMean_s) {
    waiting_ = std::exchange(still_, {});
  }
}

/// What the gyroscope showed since is its bias and its noise, and by the same noise the heading is wrong by now: the
/// two are correlated (Bar-Shalom, Li, Kirubarajan 2001, sec. 8.3: the measurement's noise with the process'). With
/// that the heading is turned back to what it was, and an hour at rest costs it next to nothing. Of tilt the
/// accelerometer has seen some of that noise already, nobody knows how much: there the measurement counts for less
/// instead. The mean is that of some time ago: what the bias wandered since is in its variance, and not told by it
/// (what of the heading came of that wander is left out: it is smaller by a thousand).
[[gnu::noinline]] inline void Inertial::hold_heading(float gate, const param::InertialParameters& n) {
  const float density = n.gyro_radps_rthz * n.gyro_radps_rthz;
  const nav::Vector3 up_b = ins_.x.q_nb.z_seen();
  if (ins_.pending_s() > 0.0F) ins_.predict_covariance();
  // Unless something told the heading so well meanwhile that the noise is not in it any more.
  const float shared = ins_.p(8, 8) > 4.0F * density * waiting_.s ? density : 0.0F;
  const float walk = n.gyro_bias_radps2_rthz * n.gyro_bias_radps2_rthz * (0.5F * waiting_.s + still_.s);
  nav::Vector3 doubt, since;
  for (int i = 0; i < 3; ++i) {
    const float half = 0.5F * ins_.p(12 + i, 12 + i);
    since(i) = walk < half ? walk : half;
    ins_.p(12 + i, 12 + i) -= since(i);
    ins_.p(8, 12 + i) -= shared * up_b(i);
    doubt(i) = 4.0F - 3.0F * up_b(i) * up_b(i);
  }
  // What stands turns with the Earth.
  const nav::Vector3 still_b = waiting_.rate_radps - ins_.x.q_nb.conjugate().rotate(ins_.earth.rate_n_radps);
  static_cast<void>(update(
      model::ZeroRate{.gyro_b_radps = still_b, .sigma_radps = base::sqrt(density / waiting_.s), .doubt = doubt}, gate));
  for (int i = 0; i < 3; ++i) {
    ins_.p(8, 12 + i) += shared * up_b(i);
    ins_.p(12 + i, 12 + i) += since(i);
  }
}

/// The IMU has shown for a second nothing but its own noise, which it also does at constant velocity; and the mean of
/// what GNSS said of it meanwhile is none.
inline bool Inertial::resting(base::Micros stamp, const Context& ctx) const {
  const float most = ctx.parameters.inertial.still_gnss_mps;
  constexpr base::Micros kLong{1'000'000};
  return calm_.us > 0 && stamp - calm_ > kLong && grounds_ >= 5 && stamp - ground_ < kLong &&
         ground_mps_.squaredNorm() < most * most;
}

}  // namespace tetap::estimators
