// SPDX-License-Identifier: Apache-2.0
// One inertial increment carried into position, velocity and attitude (Groves 2013, sec. 5.4, in a level plane that
// is fixed to the Earth).
#pragma once

#include "tetap/nav/gravity.hpp"
#include "tetap/nav/imu_increment.hpp"
#include "tetap/nav/ins_state.hpp"

namespace tetap::nav {

/// Quantities of a step of the state that the covariance needs.
struct StrapdownStep {
  float dt_s = 0;
  Vector3 dv_n_mps = Vector3::Zero();  ///< R (dv - b_a dt): specific force, gravity not in it
  Matrix3 r_nb = Matrix3::Identity();  ///< at the begin
};

/// Moves x by the increment: docs/explanation/equations.md (5) to (7). Velocity and attitude are exact for the
/// increment, the position is their trapezoid.
inline StrapdownStep strapdown(InsState& x, const ImuIncrement& imu, const Earth& earth) {
  StrapdownStep step{.dt_s = base::seconds(imu.dt), .r_nb = x.q_nb.matrix()};
  const float dt_s = step.dt_s;
  const Vector3 dtheta_b = imu.dtheta_b_rad - x.b_g_radps * dt_s;
  // Whoever made the increment turned the specific force with the biased rate: half of that angle is taken back.
  const Vector3 unturned = cross((0.5F * dt_s) * x.b_g_radps, imu.dv_b_mps);
  step.dv_n_mps = step.r_nb * (imu.dv_b_mps - x.b_a_mps2 * dt_s - unturned);
  const Vector3 before = x.v_n_mps;
  x.v_n_mps += step.dv_n_mps;
  x.v_n_mps -= (earth.gravity_mps2 * dt_s) * earth.up_n;
  x.q_nb = x.q_nb * exp_quaternion(dtheta_b);
  if (earth.rotates()) {
    x.v_n_mps -= (2.0F * dt_s) * cross(earth.rate_n_radps, before);
    x.q_nb = exp_quaternion(-dt_s * earth.rate_n_radps) * x.q_nb;
  }
  x.q_nb = x.q_nb.renormalised();
  const float half_s = 0.5F * dt_s;
  move(x.x, half_s * (before(0) + x.v_n_mps(0)));
  move(x.y, half_s * (before(1) + x.v_n_mps(1)));
  move(x.z, half_s * (before(2) + x.v_n_mps(2)));
  return step;
}

}  // namespace tetap::nav
