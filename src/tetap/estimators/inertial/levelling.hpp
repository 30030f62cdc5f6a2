// SPDX-License-Identifier: Apache-2.0
// Levelling: an attitude that turns with the gyroscope and leans towards the specific force.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/nav/imu_increment.hpp"
#include "tetap/nav/so3.hpp"

namespace tetap::estimators {

class Levelling {
 public:
  struct Step {
    bool used = false;        ///< the sample showed a force to level by
    bool first = false;       ///< the first one
    bool level = false;       ///< gravity was looked at for long enough
    bool just_level = false;  ///< with this sample for the first time
  };

  [[nodiscard]] const nav::Quaternion& attitude() const { return q_nb_; }
  [[nodiscard]] bool begun() const { return levelled_s_ > 0.0F; }

  /// One increment; `long_s`: how long gravity is looked at. The first sample turns the attitude upright at once, later
  /// ones by ever smaller shares of the rest.
  Step update(const nav::ImuIncrement& imu, float long_s) {
    const float dt_s = base::seconds(imu.dt);
    q_nb_ = (q_nb_ * nav::exp_quaternion(imu.dtheta_b_rad)).renormalised();
    const nav::Vector3 up_n = q_nb_.rotate(imu.dv_b_mps);
    const float norm = base::sqrt(up_n.squaredNorm());
    const bool before = levelled_s_ >= long_s;
    if (norm < 3.0F * dt_s) return {.level = before};  // free fall
    const float memory_s = before ? 5.0F * long_s : levelled_s_ + dt_s;
    const nav::Vector3 lean = nav::cross(up_n / norm, nav::Vector3{0.0F, 0.0F, 1.0F});
    const float share = dt_s / memory_s;
    const bool first = !begun();
    q_nb_ = (nav::exp_quaternion(first ? whole_turn(up_n / norm) : nav::Vector3(lean * share)) * q_nb_).renormalised();
    levelled_s_ += dt_s;
    const bool level = levelled_s_ >= long_s;
    return {.used = true, .first = first, .level = level, .just_level = level && !before};
  }
  static constexpr auto members(auto& self) { return base::members(self.q_nb_, self.levelled_s_); }

 private:
  /// The turn that brings a unit vector upright; upside down it goes over x.
  static nav::Vector3 whole_turn(const nav::Vector3& up) {
    const nav::Vector3 axis = nav::cross(up, nav::Vector3{0.0F, 0.0F, 1.0F});
    const float s = base::sqrt(axis.squaredNorm());
    if (s < 1e-3F) return up(2) > 0.0F ? nav::Vector3(nav::Vector3::Zero()) : nav::Vector3{3.14159265F, 0.0F, 0.0F};
    return axis * (base::atan2(s, up(2)) / s);
  }

  nav::Quaternion q_nb_;
  float levelled_s_ = 0;  ///< how long gravity was looked at
};

}  // namespace tetap::estimators
