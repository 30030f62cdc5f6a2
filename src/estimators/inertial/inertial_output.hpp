// SPDX-License-Identifier: Apache-2.0
// Inertial navigation, part: what is published, and the bits of the state.
#pragma once

#include "estimators/inertial/inertial.hpp"

namespace tetap::estimators {

/// What of the way to the present no IMU saw, as the filter will grow there: over all of it, or over what is missing,
/// at its end, too. Variance of velocity per (m/s^2)^2, or of attitude per (rad/s)^2.
inline float Inertial::unseen_s2(float unseen_s) const {
  constexpr float kLasts_s = 0.1F;  // Ins::predict_without_imu
  constexpr base::Micros kHole{25'000};
  if (blind_) return ahead_s() * ahead_s();
  const base::Micros open = now_ - ahead_.place().reached;
  return kLasts_s * (unseen_s + (open > kHole ? base::seconds(open) : 0.0F));
}

/// From the time of the covariance to the present. In place: a pose needs little of it.
[[gnu::always_inline]] inline nav::InsCovarianceStep<float> Inertial::step_ahead(
    const param::InertialParameters& n) const {
  nav::InsCovarianceStep<float> step = ins_.step_to(now_x(), ahead_s());
  const float unseen_m2ps2 = unseen_s2(ahead_.place().unseen_s) * n.gap_mps2 * n.gap_mps2;
  const float turn_radps = unseen_turn_radps(n), half_s = 0.5F * ahead_s();
  step.var_p += half_s * half_s * unseen_m2ps2;
  step.var_v += unseen_m2ps2;
  step.var_theta += unseen_s2(ahead_.place().unseen_turn_s) * turn_radps * turn_radps;
  return step;
}

inline InertialEstimate Inertial::inertial(const Context& ctx) const {
  const param::InertialParameters& n = ctx.parameters.inertial;
  return {.state = now_x(),
          .p = ins_.p,
          .ahead = step_ahead(n),
          .valid = phase_ == Phase::kTracking,
          .jump = jump_,
          .imu = imu_.health()};
}

inline Estimate Inertial::estimate(const Context& ctx) const {
  const nav::InsState& x = now_x();
  const bool valid = phase_ == Phase::kTracking;
  const nav::InsCovarianceStep<float> ahead = step_ahead(ctx.parameters.inertial);
  const nav::Vector3 v_b = x.q_nb.conjugate().rotate(x.v_n_mps);
  const nav::Vector3 w_n = x.q_nb.rotate((valid ? ahead_.place().rate_b_radps : rate_b_radps_) - x.b_g_radps);
  constexpr int kX = nav::InsState::kPosition, kY = kX + 1, kYaw = nav::InsState::kAttitude + 2;
  filter::Symmetric<float, 3> p;
  if (valid) {
    p(0, 0) = nav::predicted_covariance<kX, kX>(ins_.p, ahead);
    p(0, 1) = nav::predicted_covariance<kX, kY>(ins_.p, ahead);
    p(1, 1) = nav::predicted_covariance<kY, kY>(ins_.p, ahead);
    p(0, 2) = nav::predicted_covariance<kX, kYaw>(ins_.p, ahead);
    p(1, 2) = nav::predicted_covariance<kY, kYaw>(ins_.p, ahead);
    p(2, 2) = nav::predicted_covariance<kYaw, kYaw>(ins_.p, ahead);
  } else {
    constexpr float kPlace = kUnknown_m * kUnknown_m;
    p = filter::Symmetric<float, 3>::diagonal({kPlace, kPlace, kUnknown_rad * kUnknown_rad});
  }
  return {.time = now_,
          .pose = {.x = x.x, .y = x.y, .yaw_rad = nav::euler(x.q_nb).yaw_rad},
          .p = p,
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
  for (std::size_t c = 0; c < kN; ++c)
    for (std::size_t r = 0; r < kN; ++r)
      sum += row[r] * row[c] * p(kFirst + static_cast<int>(r), kFirst + static_cast<int>(c));
  return sum;
}

}  // namespace detail

/// Of the speed ahead, x_b . R^T v at the present: by velocity, attitude (as far as it does not go where it looks, and
/// by what it took for acceleration since) and the accelerometer's bias; to second order by a heading in doubt. Of the
/// turn: what tells it, and how long ago.
[[gnu::noinline]] inline MotionVariance Inertial::motion_variance(const Context& ctx) const {
  const InertialEstimate full = inertial(ctx);
  if (!full.valid) return {};
  const param::InertialParameters& n = ctx.parameters.inertial;
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
  if (blind_) {
    const float turn_radps = unseen_turn_radps(n);
    variance.yaw_rate_rad2ps2 = turn_radps * turn_radps;
    return variance;
  }
  const nav::Vector3 up_b = q.z_seen();
  const std::array<float, 3> turn{up_b(0), up_b(1), up_b(2)};
  const float gyro = ins_.vibration * n.gyro_radps_rthz;
  const float period_s = base::seconds(base::Micros{ctx.parameters.loop.period_us});
  // A sample is a mean, true in its middle.
  const float age_s = base::seconds(now_ - ahead_.place().last) + 0.5F * period_s;
  const float aged = ctx.parameters.loop.turn_radps2 * age_s;
  variance.yaw_rate_rad2ps2 =
      detail::quadratic<nav::InsState::kGyroBias>(full.p, turn) + gyro * gyro / period_s + aged * aged;
  return variance;
}

template <class Sink>
void Inertial::hash_state(Sink&& sink) const {
  ins_.x.hash_state(sink);
  ahead_.hash_state(sink);
  for (const Still& still : {still_, waiting_}) {
    for (int i = 0; i < 3; ++i) sink(still.rate_radps(i));
    sink(still.s);
  }
  ins_.each_bit_of_p(sink);
  sink(static_cast<std::uint32_t>(phase_));
  start_.hash_state(sink);
  sink(time_.us);
  sink(last_position_.us);
  sink(moved_.us);
  for (const base::Micros at : {ground_, calm_, bridged_, wheels_, counts_time_, constrained_, stood_, wrong_way_.since,
                                wrong_way_at_, anew_at_})
    sink(at.us);
  for (int i = 0; i < 3; ++i) {
    sink(ground_mps_(i));
    sink(rate_b_radps_(i));
  }
  sink(static_cast<std::uint32_t>(counts_.left | counts_.right << 16U));
  const unsigned flags = (have_counts_ ? 1U : 0U) | (unusable_ ? 2U : 0U) | (anew_ ? 4U : 0U) | (waits_ ? 8U : 0U) |
                         (speed_known_ ? 16U : 0U) | (stand_waits_ ? 32U : 0U) | (one_by_one_ ? 64U : 0U);
  sink(static_cast<std::uint32_t>(flags | unsigned{corrected_} << 8U));
  sink(work_left_);
  sink(wrong_way_.in_a_row);
  sink(grounds_);
  sink(wheel_turn_radps_);
  sink(gained_mps_);
  imu_.hash_state(sink);
  slip_.hash_state(sink);
  for (const Refused& refused : refused_) {
    sink(refused.in_a_row);
    sink(refused.since.us);
  }
  first_fixes_.hash_state(sink);
  frozen_.hash_state(sink);
  drift_.hash_state(sink);
  place_.hash_state(sink);
  height_.hash_state(sink);
  sink(led_m_[0]);
  sink(led_m_[1]);
  sink(jump_.east_m);
  sink(jump_.north_m);
  sink(jump_.up_m);
  sink(jump_.yaw_rad);
  sink(static_cast<std::uint32_t>(jump_.cause));
  if (!base::is_finite(jump_.yaw_rad)) ahead_.present().hash_state(sink);
  sink(static_cast<std::uint32_t>(recoveries_));
  sink(static_cast<std::uint32_t>(jump_.count | (doubted_ ? 256U : 0U) | (back_ ? 512U : 0U)));
  field_.hash_state(sink);
  baro_.hash_state(sink);
  fluxes_.hash_state(sink);
  pressures_.hash_state(sink);
  headings_.hash_state(sink);
  sink(rolled_mps_);
  sink(rolled_.us);
}

}  // namespace tetap::estimators
