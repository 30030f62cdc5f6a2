// SPDX-License-Identifier: Apache-2.0
// A span of inertial increments folded into one, independent of where it began (Forster et al. 2017, IEEE T-RO 33(1),
// sec. V-VI): a state at its begin and a few chunks give the state at the end without the samples.
#pragma once

#include "nav/strapdown.hpp"

namespace tetap::nav {

struct ImuChunk {
  base::Micros dt{};
  Quaternion q;                        ///< from the axes at the end into those at the begin
  Vector3 dv_mps = Vector3::Zero();    ///< specific force integrated, in the axes at the begin
  Vector3 dp_m = Vector3::Zero();      ///< and once more
  Vector3 b_a_mps2 = Vector3::Zero();  ///< the biases taken off
  Vector3 b_g_radps = Vector3::Zero();
  Matrix3 r_dt = Matrix3::Zero();  ///< integral of the rotation: what a constant bias does, to first order

  /// Empty, to be filled with the biases of this state.
  [[nodiscard]] static ImuChunk with_biases_of(const InsState& x) {
    return {.b_a_mps2 = x.b_a_mps2, .b_g_radps = x.b_g_radps};
  }
  /// Adds an increment that ImuIncrement::check() accepts.
  void add(const ImuIncrement& imu) {
    const float dt_s = base::seconds(imu.dt);
    const Matrix3 r = q.matrix();
    const Vector3 unturned = cross((0.5F * dt_s) * b_g_radps, imu.dv_b_mps);  // as in strapdown()
    const Vector3 gained = r * (imu.dv_b_mps - b_a_mps2 * dt_s - unturned);
    dp_m += dv_mps * dt_s + gained * (0.5F * dt_s);
    dv_mps += gained;
    r_dt += r * dt_s;
    q = (q * exp_quaternion(imu.dtheta_b_rad - b_g_radps * dt_s)).renormalised();
    dt += imu.dt;
  }
  /// This span and the one that follows it, integrated with the same biases.
  [[nodiscard]] ImuChunk then(const ImuChunk& next) const {
    const float next_s = base::seconds(next.dt);
    const Matrix3 r = q.matrix();
    ImuChunk both = *this;
    both.dp_m += dv_mps * next_s + r * next.dp_m;
    both.dv_mps += r * next.dv_mps;
    both.r_dt += r * next.r_dt;
    both.q = (q * next.q).renormalised();
    both.dt += next.dt;
    return both;
  }
  /// The state at the end from the state at the begin. Biases that have changed since count to first order, the
  /// rotation taken as even over the span: right to (change of the gyroscope's bias * dt)^2.
  [[nodiscard]] InsState apply(const InsState& from, const Earth& earth) const {
    const float dt_s = base::seconds(dt);
    const Vector3 db_a = from.b_a_mps2 - b_a_mps2;
    const Vector3 turn = -(r_dt * (from.b_g_radps - b_g_radps));  // at the end, in the axes at the begin
    const Vector3 slowed = r_dt * db_a;
    const Vector3 dv = dv_mps - slowed + 0.5F * cross(turn, dv_mps);
    const Vector3 dp = dp_m - (0.5F * dt_s) * slowed + (1.0F / 3.0F) * cross(turn, dp_m);
    const Matrix3 r = from.q_nb.matrix();
    InsState x = from;
    Vector3 change = r * dv;
    Vector3 path = r * dp;
    x.q_nb = from.q_nb * exp_quaternion(turn) * q;
    if (earth.rotates()) {  // to first order of its rate, the specific force taken as even
      const Vector3 turned = -dt_s * earth.rate_n_radps;
      const Vector3 middle{from.v_n_mps(0) + 0.5F * change(0), from.v_n_mps(1) + 0.5F * change(1), from.v_n_mps(2)};
      const Vector3 coriolis = 2.0F * cross(turned, middle);
      path += (1.0F / 3.0F) * cross(turned, path) + (0.5F * dt_s) * coriolis;
      change += 0.5F * cross(turned, change) + coriolis;
      x.q_nb = exp_quaternion(turned) * x.q_nb;
    }
    change(2) -= earth.gravity_mps2 * dt_s;
    path += from.v_n_mps * dt_s;
    path(2) -= earth.gravity_mps2 * (0.5F * dt_s * dt_s);
    x.v_n_mps += change;
    x.q_nb = x.q_nb.renormalised();
    move(x.x, path(0));
    move(x.y, path(1));
    move(x.z, path(2));
    return x;
  }
};

}  // namespace tetap::nav
