// SPDX-License-Identifier: Apache-2.0
// Inertial navigation: what is published.
#include "tetap/base/multiply_add.hpp"
#include "tetap/estimators/inertial/inertial.hpp"
#include "tetap/filter/unroll.hpp"

namespace tetap::estimators {

namespace detail {

/// Gravity presses the robot's roof down, which it does not even in a flip: then its accelerometer is reversed.
/// `before`: the attitude while there is no filter, else null.
[[nodiscard]] inline bool stands_on_its_roof(const nav::Ins& ins, const nav::Quaternion* before) {
  constexpr float kRoof = -0.7F, kHalf_mps2 = 5;
  const nav::Quaternion& q_nb = before != nullptr ? *before : ins.x.q_nb;
  if (q_nb.z_seen()(2) > kRoof) return false;
  const nav::Vector3 force_n_mps2 = ins.accel_n_mps2 + ins.earth.gravity_mps2 * ins.earth.up_n;
  return before != nullptr || q_nb.conjugate().rotate(force_n_mps2)(2) < -kHalf_mps2;
}

}  // namespace detail

template <class Watch>
sensor::Mode InertialWith<Watch>::mode(const Context& ctx) const {
  if (phase_ == Phase::kLevelling)
    return alignment_.levelling() ? sensor::Mode::kLevelling : sensor::Mode::kWaitingForImu;
  if (phase_ == Phase::kFindingHeading)
    return alignment_.placed() ? sensor::Mode::kFindingHeading : sensor::Mode::kWaitingForPose;
  const bool dead_reckoning = sources_.position.timed_out(time_);
  if (predictor_.without_imu() || imu_.missing_lately(time_)) {
    const bool carried = sources_.wheels.encoders().counts_lately(time_) || sources_.position.fused_lately(time_);
    return carried ? sensor::Mode::kDegraded : sensor::Mode::kWaitingForImu;
  }
  if (view(time_, ctx).slip() != Wheels::Slip::kNone || sources_.any_refused(3)) return sensor::Mode::kDegraded;
  return dead_reckoning ? sensor::Mode::kDeadReckoning : sensor::Mode::kNominal;
}

/// For the status of the present.
template <class Watch>
std::uint16_t InertialWith<Watch>::faults() const {
  std::uint16_t bits = 0;
  const auto raise = [&bits](sensor::Fault fault, bool is) {
    if (is) bits = static_cast<std::uint16_t>(bits | 1U << static_cast<unsigned>(fault));
  };
  const checks::ImuHealth& imu = imu_.health();
  // No turn of a reversed IMU judges wheels.
  const bool judged = !detail::stands_on_its_roof(ins_, tracking() ? nullptr : &alignment_.attitude());
  raise(sensor::Fault::kWheelSlip, judged && sources_.wheels.slip() != Wheels::Slip::kNone);
  raise(sensor::Fault::kImuClipped, imu.clipped_lately(time_));
  raise(sensor::Fault::kVibration, imu.vibration().shaken() || imu_.leapt_lately(time_));
  // Each cause of the mode Degraded has a bit. A slip that is not judged has the row of the IMU, which is distrusted.
  const bool missing = tracking() && imu_.missing_lately(time_), was_stuck = tracking() && imu.stuck_lately(time_);
  raise(sensor::Fault::kSensorStuck, imu.stuck() || was_stuck || sources_.any_stuck(time_));
  raise(sensor::Fault::kInputStale,
        (predictor_.without_imu() || (missing && !was_stuck)) && !imu.stuck() && !imu_.unusable());
  raise(sensor::Fault::kRejecting, tracking() && (imu_.unusable() || sources_.any_refused(3)));
  return bits;
}

template <class Watch>
SourceStates InertialWith<Watch>::sources(const Context& ctx) const {
  SourceStates states;
  const auto row = [&](sensor::Sensor of, const SourceStatus& status) {
    states.set(of, {status.state, status.failed});
  };
  SourceStatus imu = imu_.status(time_, ctx.parameters.inertial);
  if (imu.state == SourceState::kFusing &&
      detail::stands_on_its_roof(ins_, tracking() ? nullptr : &alignment_.attitude()))
    imu.distrusted(Check::kValue);
  row(sensor::Sensor::kImu, imu);
  row(sensor::Sensor::kGnssPosition, sources_.position.status(time_));
  row(sensor::Sensor::kGnssVelocity, sources_.velocity.status(time_));
  row(sensor::Sensor::kWheelSpeed, sources_.wheels.status(time_));
  row(sensor::Sensor::kBodySpeed, sources_.forward.status(time_));
  row(sensor::Sensor::kHeading, sources_.heading.status(time_));
  row(sensor::Sensor::kMagnetometer, sources_.magnetometer.status(time_));
  row(sensor::Sensor::kBarometer, sources_.barometer.status(time_));
  return states;
}

/// Span to the present without IMU, squared, as the filter will grow there. It covers all of the span without an IMU,
/// else the missing parts, one at its end included. Variance of velocity per (m/s^2)^2, or of attitude per (rad/s)^2.
template <class Watch>
float InertialWith<Watch>::unseen_s2(float unseen_s) const {
  constexpr float kLasts_s = 0.1F;  // Ins::predict_without_imu
  constexpr base::Micros kHole{25'000};
  if (predictor_.without_imu()) return ahead_s() * ahead_s();
  const base::Micros open = predictor_.time() - predictor_.place().reached;
  return kLasts_s * (unseen_s + (open > kHole ? base::seconds(open) : 0.0F));
}

/// From the time of the covariance to the present. In place: a pose needs little of it.
template <class Watch>
[[gnu::always_inline]] inline nav::InsCovarianceStep<float> InertialWith<Watch>::step_ahead(const Context& ctx) const {
  const param::InertialParameters& n = ctx.parameters.inertial;
  nav::InsCovarianceStep<float> step = ins_.step_to(present(), ahead_s());
  const float unseen_m2ps2 = unseen_s2(predictor_.place().unseen_s) * n.gap_mps2 * n.gap_mps2;
  const float turn_radps = unseen_turn_radps(ctx), half_s = 0.5F * ahead_s();
  step.var_p += half_s * half_s * unseen_m2ps2;
  step.var_v += unseen_m2ps2;
  step.var_theta += unseen_s2(predictor_.place().unseen_turn_s) * turn_radps * turn_radps;
  return step;
}

template <class Watch>
InertialEstimate InertialWith<Watch>::inertial(const Context& ctx) const {
  const bool fixes = sources_.position.status(time_).state != SourceState::kStopped;
  const SourceStatus height = fixes ? sources_.height.status(time_) : SourceStatus{};
  return {.state = present(),
          .p = watch_.published_p(ins_.p),
          .ahead = step_ahead(ctx),
          .valid = tracking(),
          .jump = recovery_.jump(),
          .imu = imu_.health().report(),
          .gnss_height = {height.state, height.failed}};
}

template <class Watch>
Estimate InertialWith<Watch>::estimate(const Context& ctx) const {
  const nav::InsState& x = present();
  const bool valid = tracking();
  const nav::InsCovarianceStep<float> ahead = step_ahead(ctx);
  const nav::Vector3 v_b = x.q_nb.conjugate().rotate(x.v_n_mps);
  const nav::Vector3 rate_b = valid ? predictor_.place().rate_b_radps : imu_.rate_b_radps();
  const nav::Vector3 w_n = x.q_nb.rotate(rate_b - x.b_g_radps);
  constexpr int kX = nav::InsState::kPosition, kY = kX + 1, kYaw = nav::InsState::kAttitude + 2;
  filter::Symmetric<float, 3> planar;
  const nav::Ins::Covariance& p = watch_.published_p(ins_.p);
  if (valid) {
    planar(0, 0) = nav::predicted_covariance<kX, kX>(p, ahead);
    planar(0, 1) = nav::predicted_covariance<kX, kY>(p, ahead);
    planar(1, 1) = nav::predicted_covariance<kY, kY>(p, ahead);
    planar(0, 2) = nav::predicted_covariance<kX, kYaw>(p, ahead);
    planar(1, 2) = nav::predicted_covariance<kY, kYaw>(p, ahead);
    planar(2, 2) = nav::predicted_covariance<kYaw, kYaw>(p, ahead);
  } else {
    constexpr float kPlace = kUnknown_m * kUnknown_m;
    planar = filter::Symmetric<float, 3>::diagonal({kPlace, kPlace, kUnknown_rad * kUnknown_rad});
  }
  return {.time = predictor_.time(),
          .pose = {.x = x.x, .y = x.y, .yaw_rad = nav::euler(x.q_nb).yaw_rad},
          .p = planar,
          .forward_mps = v_b(0),
          .yaw_rate_radps = w_n(2),
          .position_valid = valid,
          .heading_valid = valid,
          .velocity_valid = valid};
}

namespace detail {

/// row P row^T of the errors from kFirst on.
template <int kFirst, std::size_t kN>
[[nodiscard]] inline float quadratic(const nav::Ins::Covariance& p, const std::array<float, kN>& row) {
  float sum = 0;
  filter::unroll<0, static_cast<int>(kN)>([&](auto c) __attribute__((always_inline)) {
    const float own = row[static_cast<std::size_t>(c)];
    float half = 0.5F * (own * p(kFirst + c, kFirst + c));  // each pair of errors is met once
    filter::unroll<0, c>([&](auto r) __attribute__((always_inline)) {
      half = base::add_product(half, row[static_cast<std::size_t>(r)], p(kFirst + r, kFirst + c));
    });
    sum = base::add_product(sum, own, half);
  });
  return 2.0F * sum;
}

}  // namespace detail

/// Variance of the speed ahead, x_b . R^T v at the present: by velocity, attitude and accelerometer bias. Attitude
/// counts as far as the robot does not go where it points, and by what tilt made of acceleration since. An uncertain
/// heading adds to second order. Variance of the turn: by gyroscope noise and bias, and by the age of its sample.
template <class Watch>
[[gnu::noinline]] MotionVariance InertialWith<Watch>::motion_variance(const Context& ctx) const {
  const InertialEstimate full = inertial(ctx);
  if (!full.valid) return {};
  const nav::Quaternion& q = full.state.q_nb;
  const nav::Vector3& v = full.state.v_n_mps;
  const nav::Vector3 ahead_n = q.rotated_x();
  const nav::Vector3 by_turn = nav::cross(ahead_n, nav::Vector3(v - full.ahead.dv_n_mps));
  const std::array<float, 7> speed{ahead_n(0), ahead_n(1), ahead_n(2),      by_turn(0),
                                   by_turn(1), by_turn(2), -full.ahead.dt_s};
  const float heading = full.covariance<nav::InsState::kAttitude + 2>(), yaw_rad2 = heading < 1.0F ? heading : 1.0F;
  MotionVariance variance{.forward_m2ps2 = detail::quadratic<nav::InsState::kVelocity>(full.p, speed) +
                                           full.ahead.var_v + 0.5F * v.squaredNorm() * yaw_rad2 * yaw_rad2,
                          .yaw_rate_rad2ps2 = 0};
  if (predictor_.without_imu()) {
    const float turn_radps = unseen_turn_radps(ctx);
    variance.yaw_rate_rad2ps2 = turn_radps * turn_radps;
    return variance;
  }
  const nav::Vector3 up_b = q.z_seen();
  const std::array<float, 3> turn{up_b(0), up_b(1), up_b(2)};
  const float gyro = ins_.vibration * ctx.parameters.inertial.gyro_radps_rthz;
  const float period_s = base::seconds(base::Micros{ctx.parameters.loop.period_us});
  // A sample is a mean, true in its middle.
  const float age_s = base::seconds(predictor_.time() - predictor_.place().last) + 0.5F * period_s;
  const float aged = ctx.parameters.loop.turn_radps2 * age_s;
  variance.yaw_rate_rad2ps2 =
      detail::quadratic<nav::InsState::kGyroBias>(full.p, turn) + gyro * gyro / period_s + aged * aged;
  return variance;
}

}  // namespace tetap::estimators
