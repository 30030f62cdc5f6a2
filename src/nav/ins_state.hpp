// SPDX-License-Identifier: Apache-2.0
// The state of inertial navigation: 16 numbers, 15 errors. The attitude error is in the navigation frame,
// q_true = Exp(dtheta_n) q (Sola 2017, sec. 7: global angular error), so that gravity's coupling does not turn with the
// body.
#pragma once

#include "base/anchored.hpp"
#include "nav/so3.hpp"

namespace tetap::nav {

/// Moves a coordinate by d metres, |d| < 2e9, and keeps its offset within one metre: a float step of 60 nm, so that at
/// 400 Hz a creep of 1 mm/s still adds up (in an offset of 100 m it would be rounded away). Whole metres are exact in
/// both parts.
constexpr void move(base::Anchored& coordinate, float d_m) {
  const auto carry = [&](float m) {
    const auto whole = static_cast<std::int32_t>(m);
    coordinate.anchor_um += std::int64_t{whole} * 1'000'000;
    return m - static_cast<float>(whole);
  };
  if (d_m > 1.0F || d_m < -1.0F) d_m = d_m < 2e9F && d_m > -2e9F ? carry(d_m) : 0.0F;
  coordinate.offset_m += d_m;
  if (coordinate.offset_m > 1.0F || coordinate.offset_m < -1.0F) {
    const float offset = coordinate.offset_m;
    coordinate.offset_m = offset < 2e9F && offset > -2e9F ? carry(offset) : 0.0F;
  }
}

struct InsState {
  using Scalar = float;
  static constexpr int kErrors = 15;
  /// Where each group of three begins in the error vector.
  static constexpr int kPosition = 0, kVelocity = 3, kAttitude = 6, kAccelBias = 9, kGyroBias = 12;
  using Error = filter::Vector<float, kErrors>;

  base::Anchored x, y, z;  ///< east, north, up of the body's origin
  Vector3 v_n_mps = Vector3::Zero();
  Quaternion q_nb;
  Vector3 b_a_mps2 = Vector3::Zero();   ///< in b; the sensor shows specific force + bias
  Vector3 b_g_radps = Vector3::Zero();  ///< in b

  [[nodiscard]] InsState plus(const Error& dx) const {
    InsState moved = *this;
    move(moved.x, dx(0));
    move(moved.y, dx(1));
    move(moved.z, dx(2));
    moved.v_n_mps += dx.segment<3>(kVelocity);
    moved.q_nb = (exp_quaternion(dx.segment<3>(kAttitude)) * q_nb).renormalised();
    moved.b_a_mps2 += dx.segment<3>(kAccelBias);
    moved.b_g_radps += dx.segment<3>(kGyroBias);
    return moved;
  }
  [[nodiscard]] Error minus(const InsState& other) const {
    Error dx;
    dx.segment<3>(kPosition) << x.minus(other.x), y.minus(other.y), z.minus(other.z);
    dx.segment<3>(kVelocity) = v_n_mps - other.v_n_mps;
    dx.segment<3>(kAttitude) = log_quaternion(q_nb * other.q_nb.conjugate());
    dx.segment<3>(kAccelBias) = b_a_mps2 - other.b_a_mps2;
    dx.segment<3>(kGyroBias) = b_g_radps - other.b_g_radps;
    return dx;
  }
  [[nodiscard]] bool finite() const {
    return base::is_finite(x.offset_m) && base::is_finite(y.offset_m) && base::is_finite(z.offset_m) &&
           is_finite(v_n_mps) && base::is_finite(q_nb.norm2()) && is_finite(b_a_mps2) && is_finite(b_g_radps);
  }
};

}  // namespace tetap::nav
