// SPDX-License-Identifier: Apache-2.0
// Velocity of a point of the body in the body's own axes, and how the errors of inertial navigation show in it. Wheels
// and the non-holonomic constraint measure it (Dissanayake et al. 2001, IEEE T-RA 17(5)).
#pragma once

#include "tetap/filter/state.hpp"
#include "tetap/nav/ins_state.hpp"

namespace tetap::model {

struct BodyVelocity {
  nav::Vector3 v_b_mps;  ///< R^T v + w x lever
  /// By velocity (3), attitude (3) and gyroscope bias (3).
  filter::Matrix<float, 3, 9> h;

  /// `moves` false: the velocity is not known from none, so the attitude shows in nothing. Else an hour of standstill
  /// would show a heading: by Jacobians of the velocity's noise.
  BodyVelocity(const nav::InsState& at, const nav::Vector3& gyro_b_radps, const nav::Vector3& lever_b_m, bool moves) {
    const nav::Matrix3 r_bn = at.q_nb.matrix().transpose();
    v_b_mps = r_bn * at.v_n_mps + nav::cross(gyro_b_radps - at.b_g_radps, lever_b_m);
    h << r_bn, nav::Matrix3::Zero(), nav::skew(lever_b_m);
    if (moves) h.block<3, 3>(0, 3) = r_bn.lazyProduct(nav::skew(at.v_n_mps));
  }
};

}  // namespace tetap::model
