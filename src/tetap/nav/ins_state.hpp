// SPDX-License-Identifier: Apache-2.0
// The state of inertial navigation: 16 numbers, 15 errors. The attitude error is in the navigation frame,
// q_true = Exp(dtheta_n) q (Sola 2017, sec. 7: global angular error). Gravity's coupling does not turn with the body
// there.
#pragma once

#include "tetap/base/anchored.hpp"
#include "tetap/base/members.hpp"
#include "tetap/nav/so3.hpp"

namespace tetap::nav {

namespace detail {

/// The whole metres of m go into the anchor, the rest comes back; both exact. Beyond 2e9 m (and NaN): nothing is left.
constexpr float carry(base::Anchored& coordinate, float m) {
  if (!(m < 2e9F && m > -2e9F)) return 0.0F;
  const auto whole = static_cast<std::int32_t>(m);
  coordinate.anchor_um += std::int64_t{whole} * 1'000'000;
  return m - static_cast<float>(whole);
}
[[gnu::noinline]] constexpr void move_far(base::Anchored& coordinate, float d_m) {
  coordinate.offset_m = carry(coordinate, coordinate.offset_m + carry(coordinate, d_m));
}

}  // namespace detail

/// Moves a coordinate by d metres, |d| < 2e9, and keeps its offset within one metre. A float step is 60 nm there: at
/// 400 Hz a creep of 1 mm/s still adds up. In an offset of 100 m it would be rounded away.
constexpr void move(base::Anchored& coordinate, float d_m) {
  const float offset_m = coordinate.offset_m + d_m;
  if (offset_m <= 1.0F && offset_m >= -1.0F) {
    coordinate.offset_m = offset_m;
  } else {
    detail::move_far(coordinate, d_m);
  }
}

/// a minus b in metres: the bits of a.minus(b), without its division of 64 bits where 32 are enough (2 km).
[[nodiscard]] constexpr float difference(const base::Anchored& a, const base::Anchored& b) {
  const std::int64_t um = a.anchor_um - b.anchor_um;
  const auto low = static_cast<std::int32_t>(um);
  if (low != um) return a.minus(b);
  const std::int32_t whole_m = low / 1'000'000;
  return (static_cast<float>(whole_m) + static_cast<float>(low % 1'000'000) * 1e-6F) + (a.offset_m - b.offset_m);
}

struct InsState {
  using Scalar = float;
  static constexpr int kErrors = 15;
  /// First index of each group of three in the error vector.
  static constexpr int kPosition = 0, kVelocity = 3, kAttitude = 6, kAccelBias = 9, kGyroBias = 12;
  static constexpr int kUp = kPosition + 2, kVelocityNorth = kVelocity + 1, kVelocityUp = kVelocity + 2;
  static constexpr int kYaw = kAttitude + 2;
  using Error = filter::Vector<float, kErrors>;

  base::Anchored x, y, z;  ///< east, north, up of the body's origin
  Vector3 v_n_mps = Vector3::Zero();
  Quaternion q_nb;
  Vector3 b_a_mps2 = Vector3::Zero();   ///< in b; the sensor shows specific force + bias
  Vector3 b_g_radps = Vector3::Zero();  ///< in b

  void correct(const Error& dx) {
    move(x, dx(0));
    move(y, dx(1));
    move(z, dx(2));
    v_n_mps += dx.segment<3>(kVelocity);
    q_nb = (exp_quaternion(dx.segment<3>(kAttitude)) * q_nb).renormalised();
    b_a_mps2 += dx.segment<3>(kAccelBias);
    b_g_radps += dx.segment<3>(kGyroBias);
  }
  [[nodiscard]] InsState plus(const Error& dx) const {
    InsState moved = *this;
    moved.correct(dx);
    return moved;
  }
  [[nodiscard]] Error minus(const InsState& other) const {
    Error dx;
    dx.segment<3>(kPosition) << difference(x, other.x), difference(y, other.y), difference(z, other.z);
    dx.segment<3>(kVelocity) = v_n_mps - other.v_n_mps;
    dx.segment<3>(kAttitude) = log_quaternion(q_nb * other.q_nb.conjugate());
    dx.segment<3>(kAccelBias) = b_a_mps2 - other.b_a_mps2;
    dx.segment<3>(kGyroBias) = b_g_radps - other.b_g_radps;
    return dx;
  }
  static constexpr auto members(auto& self) {
    return base::members(self.x, self.y, self.z, self.v_n_mps, self.q_nb, self.b_a_mps2, self.b_g_radps);
  }
  [[nodiscard]] bool finite() const {
    return base::is_finite(x.offset_m) && base::is_finite(y.offset_m) && base::is_finite(z.offset_m) &&
           is_finite(v_n_mps) && base::is_finite(q_nb.norm2()) && is_finite(b_a_mps2) && is_finite(b_g_radps);
  }
};

/// Moves the place by d [m], in n.
inline void move(InsState& at, const Vector3& d_n_m) {
  move(at.x, d_n_m(0));
  move(at.y, d_n_m(1));
  move(at.z, d_n_m(2));
}

}  // namespace tetap::nav
