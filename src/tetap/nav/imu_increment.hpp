// SPDX-License-Identifier: Apache-2.0
// Increment of an inertial sensor over a span of time: the rotation and the velocity gained in it, coning and sculling
// included (Savage 1998, J. Guid. Control Dyn. 21(1) and 21(2)).
#pragma once

#include "tetap/base/time.hpp"
#include "tetap/nav/so3.hpp"

#include <cstdint>

namespace tetap::nav {

enum class ImuVerdict : std::uint8_t { kAccepted, kNotFinite, kBadInterval, kTooFast, kDiverged };

struct ImuIncrement {
  static constexpr base::Micros kLongest{200'000};

  Vector3 dtheta_b_rad = Vector3::Zero();  ///< rotation vector from the axes at the begin to those at the end
  Vector3 dv_b_mps = Vector3::Zero();      ///< specific force integrated in the axes at the *begin*
  base::Micros dt{};

  /// Rate and specific force that were constant (in body axes) for this long.
  [[nodiscard]] static ImuIncrement constant(const Vector3& w_b_radps, const Vector3& f_b_mps2, base::Micros dt) {
    const float dt_s = base::seconds(dt);
    const Vector3 dtheta = w_b_radps * dt_s;
    const Vector3 dv = f_b_mps2 * dt_s;
    // The integral of Exp(w t) over the span: 1 + [dtheta]x/2 + [dtheta]x^2/6, next term |dtheta|^3/24.
    const Vector3 turned = cross(dtheta, dv);
    return {.dtheta_b_rad = dtheta, .dv_b_mps = dv + 0.5F * turned + (1.0F / 6.0F) * cross(dtheta, turned), .dt = dt};
  }
  /// This span and the one after it as one: coning and sculling between the two are in it, to rounding.
  [[nodiscard]] ImuIncrement then(const ImuIncrement& next) const {
    const Quaternion turned = exp_quaternion(dtheta_b_rad);
    return {.dtheta_b_rad = log_quaternion(turned * exp_quaternion(next.dtheta_b_rad)),
            .dv_b_mps = dv_b_mps + turned.rotate(next.dv_b_mps),
            .dt = dt + next.dt};
  }
  /// Limits beyond any robot, so that the state stays finite whatever comes: 100 rad/s, 1000 m/s^2 (norms) and an
  /// interval of 0.2 s.
  [[nodiscard]] ImuVerdict check() const {
    if (dt.us <= 0 || dt > kLongest) return ImuVerdict::kBadInterval;
    const float dt_s = base::seconds(dt);
    const float angle = 100.0F * dt_s, speed = 1000.0F * dt_s;
    // Norms are compared, so that the choice of axes has no effect; false for NaN.
    if (dtheta_b_rad.squaredNorm() < angle * angle && dv_b_mps.squaredNorm() < speed * speed)
      return ImuVerdict::kAccepted;
    return is_finite(dtheta_b_rad) && is_finite(dv_b_mps) ? ImuVerdict::kTooFast : ImuVerdict::kNotFinite;
  }
};

}  // namespace tetap::nav
