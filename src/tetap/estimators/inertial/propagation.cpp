// SPDX-License-Identifier: Apache-2.0
// Inertial navigation: IMU samples, spans without them, and standstill.
#include "tetap/estimators/inertial/inertial.hpp"

namespace tetap::estimators {

template <class Watch>
Innovation InertialWith<Watch>::fuse(const sensor::ImuSample& sample, base::Micros stamp, const Context& ctx) {
  const param::InertialParameters& n = ctx.parameters.inertial;
  budget_.spend(WorkBudget::kImuSample);
  nav::ImuIncrement increment = mounted(checks::increment_of(sample), n);
  const base::Micros pause = stamp - increment.dt - time_;
  const bool was_stuck = imu_.health().stuck();
  const bool turn_known = sample.clipped_gyro > 0 && tracking() && view(stamp, ctx).wheels_show_turn();
  const checks::ImuClass found = imu_.health().update(sample, increment, stamp, pause, turn_known, n);
  if (found == checks::ImuClass::kInvalid)
    return {.verdict = sensor::Verdict::kNotFinite,
            .failed = increment.check() == nav::ImuVerdict::kBadInterval ? Check::kTime : Check::kValue};
  // The predictor may have classified the sample otherwise.
  if (sample.clipped_gyro > 0 || sample.clipped_accel > 0) predictor_.note_correction();
  if (found == checks::ImuClass::kStuck) return imu_stuck(increment, was_stuck, ctx);
  imu_.set_unusable(found <= checks::ImuClass::kSaturated);
  if (imu_.unusable()) return {.verdict = sensor::Verdict::kNotUsed, .failed = Check::kValue};
  // All that was true at the last sample has been fused: wheels bring the constraint with them, and twice is too sure.
  if (tracking()) fuse_constraint(time_, ctx);
  const nav::Vector3 rate_b_radps = increment.dtheta_b_rad / base::seconds(increment.dt);
  const bool follows = found == checks::ImuClass::kContiguous;
  nav::Vector3 moved_b_m = nav::Vector3::Zero();
  if (ImuPlace(n).is_origin()) {  // the rate at a sample's end matters to an arm alone
    imu_.set_rate(rate_b_radps);
  } else {
    const nav::Vector3 before_b_radps = follows ? imu_.end_rate_b_radps() : rate_b_radps;
    follows ? imu_.follow_rate(rate_b_radps) : imu_.set_rate(rate_b_radps);
    moved_b_m = to_origin(increment, before_b_radps, n);
  }
  if (!tracking()) return align(increment, pause, stamp, ctx);
  if (found == checks::ImuClass::kOverlapping) {
    predictor_.note_correction();
    return {.verdict = sensor::Verdict::kStale, .failed = Check::kTime};
  }
  if (found == checks::ImuClass::kAfterGap) bridge_lost_samples(pause, ctx);
  return propagate(sample, increment, moved_b_m, stamp, ctx);
}

/// Takes the IMU's swing round the origin out of the increment. Gives what the position is to be moved by beside, in
/// the axes at the increment's end.
template <class Watch>
[[gnu::noinline]] nav::Vector3 InertialWith<Watch>::to_origin(nav::ImuIncrement& increment,
                                                              const nav::Vector3& before_b_radps,
                                                              const param::InertialParameters& n) const {
  const ImuPlace place(n);
  const float dt_s = base::seconds(increment.dt);
  const nav::Vector3 turn_b_rad = increment.dtheta_b_rad - ins_.x.b_g_radps * dt_s;
  const nav::Vector3 before = before_b_radps - ins_.x.b_g_radps, after = imu_.end_rate_b_radps() - ins_.x.b_g_radps;
  increment.dv_b_mps -= place.swing_mps(turn_b_rad, before, after);
  return place.moved_m(turn_b_rad, dt_s, before, after);
}

/// Repetitions before this one were taken for motion.
template <class Watch>
Innovation InertialWith<Watch>::imu_stuck(const nav::ImuIncrement& increment, bool was_stuck, const Context& ctx) {
  const param::InertialParameters& n = ctx.parameters.inertial;
  if (!was_stuck) predictor_.note_correction();
  const float false_s = static_cast<float>(imu_.health().stuck_after(n)) * base::seconds(increment.dt);
  if (!was_stuck && tracking()) Recovery::inflate_motion(ins_, n.gap_mps2 * false_s, n.gap_radps * false_s);
  return {.verdict = sensor::Verdict::kStale, .failed = Check::kStuck};
}

/// Before the filter runs.
template <class Watch>
Innovation InertialWith<Watch>::align(const nav::ImuIncrement& increment, base::Micros pause, base::Micros stamp,
                                      const Context& ctx) {
  if (checks::ImuClassifier::is_gap(pause)) alignment_.gap(pause, heading_monitor_);
  time_ = stamp;
  if (alignment_.level(increment, heading_monitor_, ctx.parameters.inertial)) phase_ = Phase::kFindingHeading;
  if (phase_ == Phase::kFindingHeading && alignment_.ready()) begin(ctx);
  return {.verdict = sensor::Verdict::kAccepted};
}

/// Lost samples are bridged; what was bridged already this sample does not show again.
template <class Watch>
void InertialWith<Watch>::bridge_lost_samples(base::Micros gap, const Context& ctx) {
  const nav::Vector3 shown = imu_.rate_b_radps();
  const base::Micros before = imu_.bridged_until();
  bridge(gap, ctx);
  if (gap <= base::Micros{ctx.parameters.inertial.stale_us}) imu_.set_bridged(before);  // a few lost are no lost IMU
  imu_.set_rate(shown);
}

template <class Watch>
Innovation InertialWith<Watch>::propagate(const sensor::ImuSample& sample, const nav::ImuIncrement& increment,
                                          const nav::Vector3& moved_b_m, base::Micros stamp, const Context& ctx) {
  const param::InertialParameters& n = ctx.parameters.inertial;
  const float dt_s = base::seconds(increment.dt);
  const float up_b = ins_.x.q_nb.rotated_x().dot(ins_.earth.up_n);  // share of gravity's reaction that points forward
  sources_.wheels.encoders().note_gain(increment.dv_b_mps(0) -
                                       (ins_.x.b_a_mps2(0) + up_b * ins_.earth.gravity_mps2) * dt_s);
  const nav::ImuVerdict verdict = ins_.predict(increment);
  if (verdict == nav::ImuVerdict::kDiverged)
    restart_filter(stamp, sensor::ResetCause::kDiverged, ctx);  // faster than anything drives
  if (verdict != nav::ImuVerdict::kAccepted) {
    time_ = stamp;
    return {.verdict = sensor::Verdict::kNotFinite, .failed = Check::kValue};
  }
  if (!ImuPlace(n).is_origin()) nav::move(ins_.x, ins_.x.q_nb.rotate(moved_b_m));
  ins_.vibration = imu_.health().vibration().noise_factor(n);
  if (ins_.pending_s() >= predictor_.schedule().covariance_every_s()) predict_covariance();
  if (sample.clipped_accel > 0 || sample.clipped_gyro > 0) inflate_clipped(sample, dt_s, n);
  if (imu_.health().vibration().leaps()) {
    const checks::Vibration::Leap& leap = imu_.health().vibration().leap();
    imu_.note_leap(stamp);
    Recovery::inflate_motion(ins_, leap.force_mps2 * dt_s, leap.rate_radps * dt_s);
  }
  time_ = stamp;
  follow_level(ctx);
  if (stamp > predictor_.last_seen()) predictor_.note_correction();  // it left the window before the present had it
  standstill_.update_rate(imu_.rate_b_radps(), dt_s);
  detect_standstill(stamp, ctx);
  if (view(stamp, ctx).wheels_timed_out()) {
    heading_monitor_.predict(increment, ins_.x.q_nb);
  } else {
    heading_monitor_.stop();
  }
  return {.verdict = sensor::Verdict::kAccepted};
}

/// The level plane follows the robot, and the IMU is judged: every 0.2 s, in a tick that has work left, or soon after.
template <class Watch>
void InertialWith<Watch>::follow_level(const Context& ctx) {
  constexpr base::Micros kEvery{200'000}, kLatest{400'000};
  const base::Micros since = time_ - levelled_at_;
  if (since < kEvery || (since < kLatest && !budget_.allows(WorkBudget::kImuSample))) return;
  budget_.spend(WorkBudget::kImuSample);
  watch_.judge(base::seconds(since));
  judge_drift(since, ctx.parameters);
  set_level(ins_.x.x, ins_.x.y, ins_.x.z, ctx);
}

/// Gravity is that of the place, and so are the axes of what a receiver or compass measures.
template <class Watch>
[[gnu::noinline]] void InertialWith<Watch>::set_level(const base::Anchored& x, const base::Anchored& y,
                                                      const base::Anchored& z, const Context& ctx) {
  levelled_at_ = time_;
  if (ctx.map_frame.origin == sensor::OriginSource::kNone) return;
  level_ = nav::LocalLevel(ctx.map_frame.frame.curvature(), x, y, z);
  ins_.earth.move_to(level_, ctx.map_frame.frame.curvature());
}

/// Clipped increments are used. They are as uncertain as none, and as half of what they show: the range that the motion
/// exceeds.
template <class Watch>
[[gnu::noinline]] void InertialWith<Watch>::inflate_clipped(const sensor::ImuSample& sample, float dt_s,
                                                            const param::InertialParameters& n) {
  constexpr float kLost = 0.5F;
  float lost_mps2 = n.gap_mps2, lost_radps = 0;
  if (sample.clipped_accel > 0) {
    const float half_mps2 = kLost * base::sqrt(ins_.accel_n_mps2.squaredNorm());
    lost_mps2 = half_mps2 > n.gap_mps2 ? half_mps2 : n.gap_mps2;
    ins_.accel_n_mps2 = nav::Vector3::Zero();
  }
  if (sample.clipped_gyro > 0) {
    const float half_radps = kLost * base::sqrt(imu_.rate_b_radps().squaredNorm());
    lost_radps = half_radps > n.gap_radps ? half_radps : n.gap_radps;
  }
  const float growth = base::sqrt(dt_s * 0.1F);
  Recovery::inflate_motion(ins_, lost_mps2 * growth, lost_radps * growth);
}

/// Measurements contradict the IMU for long: tilt, biases and climb are as uncertain as what explains it.
template <class Watch>
[[gnu::noinline]] void InertialWith<Watch>::judge_drift(base::Micros since, const param::Parameters& n) {
  constexpr int kUp = nav::InsState::kVelocityUp;
  const float fixes = n.gnss.gate_scale, wheels = n.inertial.wheel_gate_scale;
  nav::VelocityCorrection& sum = ins_.corrected;
  const float lasting_m2ps2 = ins_.level_m2ps2();
  const float scale = fixes > wheels ? fixes : wheels;
  constexpr float kKnown_m2ps2 = 1;  // beyond, a heading is being found: corrections are not linear
  if (lasting_m2ps2 > kKnown_m2ps2) {
    sum.clear_level();
  } else if (lasting_m2ps2 + sum.level_m2ps2 > kKnown_m2ps2 &&
             checks::ImuDrift::contradicts(sum, lasting_m2ps2, scale)) {
    Recovery::widen_heading(ins_, sum);
    sum.clear_level();
  }
  const checks::ImuDrift::Drift drift = imu_.drift().test(sum, lasting_m2ps2, ins_.p(kUp, kUp), scale);
  if (drift.level) {
    constexpr float kRate_hz = 2;  // a sum that has not faded yet is of half a second
    Recovery::widen_imu(ins_, kRate_hz * sum.east_mps, kRate_hz * sum.north_mps);
    sum.clear_level();
  }
  if (drift.up) {
    predict_covariance();
    Recovery::widen_climb(ins_, sum.up_mps, 0);
    sum.clear_up();
  }
  if (drift.level || drift.up) predictor_.note_correction();
  sum.fade(checks::ImuDrift::keep(base::seconds(since)));
}

/// Goes on without IMU: the velocity stays what it is in the body, which turns as the wheels show, or not at all.
template <class Watch>
[[gnu::noinline]] void InertialWith<Watch>::bridge(base::Micros gap, const Context& ctx) {
  const param::InertialParameters& n = ctx.parameters.inertial;
  const bool wheels = view(time_, ctx).wheels_show_turn();
  const float dt_s = base::seconds(gap);
  ins_.predict_without_imu(gap, n.gap_mps2, unseen_turn_radps(ctx), watch_.bank());
  nav::Vector3 w_b = nav::Vector3::Zero();
  if (wheels) {
    w_b(2) = sources_.wheels.turn_radps();
    ins_.turn_without_imu(nav::exp_quaternion(ins_.x.q_nb.rotate(w_b) * dt_s));
    // Both wheels slip by their share, each on its own, for about a second the same.
    const float slip = n.slip_share * n.slip_share * 2.0F * ins_.x.v_n_mps.squaredNorm();
    const float track_m = ctx.parameters.wheels.drive.track_m;
    Recovery::inflate_heading(ins_, slip / (track_m * track_m) * dt_s);
  }
  predictor_.note_correction();
  alignment_.gap(gap, heading_monitor_);
  imu_.set_rate(ins_.x.b_g_radps + w_b);
  time_ += gap;
  follow_level(ctx);
  imu_.set_bridged(time_);
  sources_.wheels.encoders().invalidate_gain();
  standstill_.interrupt();
}

template <class Watch>
void InertialWith<Watch>::detect_standstill(base::Micros stamp, const Context& ctx) {
  const param::InertialParameters& n = ctx.parameters.inertial;
  const FilterView filter = view(stamp, ctx);
  ins_.stands = standstill_.detect(filter, imu_.health().calm(n));
  if (!ins_.stands) return;
  const float gate = filter::chi_square_99(3) * Standstill::kGateScale;
  if (standstill_.velocity_due(filter, budget_))
    static_cast<void>(update(model::ZeroVelocity{.sigma_mps = Standstill::sigma_mps(filter)}, gate));
  if (standstill_.rate_due(filter, budget_)) fuse_zero_rate(n);
}

template <class Watch>
[[gnu::noinline]] void InertialWith<Watch>::fuse_zero_rate(const param::InertialParameters& n) {
  if (ins_.pending_s() > 0.0F) predict_covariance();
  const Standstill::ZeroRateUpdate due = standstill_.take_rate(ins_, n);
  budget_.spend(WorkBudget::kMeasurement);
  predictor_.note_correction();
  const float gate = filter::chi_square_99(3) * Standstill::kGateScale;
  static_cast<void>(ins_.update_shared_noise(due.model, gate, due.shared, due.wander, watch_.bank()));
}

}  // namespace tetap::estimators
