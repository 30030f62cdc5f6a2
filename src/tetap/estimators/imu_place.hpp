// SPDX-License-Identifier: Apache-2.0
// An IMU away from the body's origin swings round it: v_imu = v + R (w x r). Differences of that are taken out of its
// increments, so that no noise of the gyroscope adds up in the velocity (Groves 2013, sec. 5.5.5).
#pragma once

#include "tetap/nav/imu_increment.hpp"
#include "tetap/nav/ins_state.hpp"
#include "tetap/param/parameters.hpp"

namespace tetap::estimators {

/// Turn rates are in body axes and without bias [rad/s]. An IMU at the origin costs a comparison, and changes no bit.
class ImuPlace {
 public:
  explicit ImuPlace(const param::InertialParameters& n)
      : b_m_{n.position_b_m[0], n.position_b_m[1], n.position_b_m[2]} {}

  [[nodiscard]] bool is_origin() const { return b_m_.squaredNorm() <= 0.0F; }
  /// Velocity that the IMU gains beyond the origin in an increment that turns by dtheta, in the axes at its begin
  /// [m/s].
  [[nodiscard]] nav::Vector3 swing_mps(const nav::Vector3& dtheta_b_rad, const nav::Vector3& before_b_radps,
                                       const nav::Vector3& after_b_radps) const {
    return nav::exp_quaternion(dtheta_b_rad).rotate(nav::cross(after_b_radps, b_m_)) - nav::cross(before_b_radps, b_m_);
  }
  /// Displacement of the origin in an increment, beyond the trapezoid of velocities that swing_mps() was taken out of,
  /// in the axes at its end [m]: rates at the ends show a turn within the increment to second order only.
  [[nodiscard]] nav::Vector3 moved_m(const nav::Vector3& dtheta_b_rad, float dt_s, const nav::Vector3& before_b_radps,
                                     const nav::Vector3& after_b_radps) const {
    const nav::Quaternion back = nav::exp_quaternion(-dtheta_b_rad);
    const nav::Vector3 sum = back.rotate(nav::cross(before_b_radps, b_m_)) + nav::cross(after_b_radps, b_m_);
    return (0.5F * dt_s) * sum + back.rotate(b_m_) - b_m_;
  }
  /// The origin's state becomes the IMU's.
  void to_imu(nav::InsState& x, const nav::Vector3& rate_b_radps) const {
    if (!is_origin()) shift(x, 1.0F, rate_b_radps);
  }
  void to_origin(nav::InsState& x, const nav::Vector3& rate_b_radps) const {
    if (!is_origin()) shift(x, -1.0F, rate_b_radps);
  }
  /// The IMU's state when the turn rate has changed unseen, and the origin's velocity has not.
  void change_rate(nav::InsState& x, const nav::Vector3& by_b_radps) const {
    if (!is_origin()) x.v_n_mps += x.q_nb.rotate(nav::cross(by_b_radps, b_m_));
  }

 private:
  [[gnu::noinline]] void shift(nav::InsState& x, float share, const nav::Vector3& rate_b_radps) const {
    nav::move(x, x.q_nb.rotate(share * b_m_));
    x.v_n_mps += x.q_nb.rotate(nav::cross(share * rate_b_radps, b_m_));
  }

  nav::Vector3 b_m_;
};

}  // namespace tetap::estimators
