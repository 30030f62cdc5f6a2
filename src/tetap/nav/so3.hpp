// SPDX-License-Identifier: Apache-2.0
// Rotations as unit quaternions (Hamilton, w first; q_nb rotates b into n). The exponential, its inverse and their
// small-angle terms are those of Sola 2017, "Quaternion kinematics for the error-state Kalman filter", eq. 101 and 105.
#pragma once

#include "tetap/base/math.hpp"
#include "tetap/filter/symmetric.hpp"

namespace tetap::nav {

using Vector3 = filter::Vector<float, 3>;
using Matrix3 = filter::Matrix<float, 3, 3>;

[[nodiscard]] inline Vector3 cross(const Vector3& a, const Vector3& b) {
  return {a(1) * b(2) - a(2) * b(1), a(2) * b(0) - a(0) * b(2), a(0) * b(1) - a(1) * b(0)};
}

/// [a]x: skew(a) b = a x b.
[[nodiscard]] inline Matrix3 skew(const Vector3& a) {
  Matrix3 m;
  m << 0.0F, -a(2), a(1), a(2), 0.0F, -a(0), -a(1), a(0), 0.0F;
  return m;
}

[[nodiscard]] inline bool is_finite(const Vector3& a) {
  return base::is_finite(a(0)) && base::is_finite(a(1)) && base::is_finite(a(2));
}

struct Quaternion {
  float w = 1, x = 0, y = 0, z = 0;

  friend constexpr Quaternion operator*(const Quaternion& a, const Quaternion& b) {
    return {a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z, a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
            a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x, a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w};
  }
  [[nodiscard]] constexpr Quaternion conjugate() const { return {w, -x, -y, -z}; }
  [[nodiscard]] constexpr float norm2() const { return (w * w + x * x) + (y * y + z * z); }

  /// One Newton step for 1/|q|: an error e of the norm becomes 1.5 e^2, so what one product rounds away comes back.
  [[nodiscard]] constexpr Quaternion renormalised() const {
    const float scale = 1.5F - 0.5F * norm2();
    return {w * scale, x * scale, y * scale, z * scale};
  }
  [[nodiscard]] Matrix3 matrix() const {
    const float x2 = x + x, y2 = y + y, z2 = z + z;
    const float xx = x * x2, yy = y * y2, zz = z * z2;
    const float xy = x * y2, xz = x * z2, yz = y * z2;
    const float wx = w * x2, wy = w * y2, wz = w * z2;
    Matrix3 r;
    r << 1.0F - (yy + zz), xy - wz, xz + wy, xy + wz, 1.0F - (xx + zz), yz - wx, xz - wy, yz + wx, 1.0F - (xx + yy);
    return r;
  }
  /// q v q*, cheaper than matrix() for one vector.
  /// rotate({1, 0, 0}): where x of b points, in n.
  [[nodiscard]] Vector3 rotated_x() const {
    return {1.0F - 2.0F * (y * y + z * z), 2.0F * (x * y + w * z), 2.0F * (x * z - w * y)};
  }
  /// conjugate().rotate({0, 0, 1}): where z of n points, in b.
  [[nodiscard]] Vector3 z_seen() const {
    return {2.0F * (x * z - w * y), 2.0F * (y * z + w * x), 1.0F - 2.0F * (x * x + y * y)};
  }
  [[nodiscard]] Vector3 rotate(const Vector3& v) const {
    const Vector3 u{x, y, z};
    const Vector3 t = 2.0F * cross(u, v);
    return v + w * t + cross(u, t);
  }
};

/// The rotation by |phi| about phi.
[[nodiscard]] inline Quaternion exp_quaternion(const Vector3& phi) {
  const float angle2 = phi(0) * phi(0) + phi(1) * phi(1) + phi(2) * phi(2);
  if (angle2 < 0.25F) {  // next terms below 4e-10
    const float h2 = 0.25F * angle2;
    const float half_sinc = 0.5F - h2 * (1.0F / 12.0F - h2 * (1.0F / 240.0F - h2 * (1.0F / 10080.0F)));
    const float cosine = 1.0F - h2 * (0.5F - h2 * (1.0F / 24.0F - h2 * (1.0F / 720.0F)));
    return {cosine, half_sinc * phi(0), half_sinc * phi(1), half_sinc * phi(2)};
  }
  const float angle = base::sqrt(angle2);
  const base::SinCos half = base::sincos(0.5F * angle);
  const float scale = half.sin / angle;
  return {half.cos, scale * phi(0), scale * phi(1), scale * phi(2)};
}

/// The rotation vector of a unit quaternion, the shorter way round: |phi| <= pi.
[[nodiscard]] inline Vector3 log_quaternion(const Quaternion& q) {
  const float sign = q.w < 0.0F ? -1.0F : 1.0F;
  const float w = sign * q.w;
  const Vector3 v{sign * q.x, sign * q.y, sign * q.z};
  const float n2 = v(0) * v(0) + v(1) * v(1) + v(2) * v(2);
  if (n2 < 0.01F * w * w) {  // atan(t)/t, next term below 1e-9
    const float t2 = n2 / (w * w);
    return v * (2.0F / w * (1.0F - t2 * (1.0F / 3.0F - t2 * (0.2F - t2 * (1.0F / 7.0F)))));
  }
  const float n = base::sqrt(n2);
  return v * (2.0F * base::atan2(n, w) / n);
}

/// Yaw, pitch, roll (z, y, x: yaw counter-clockwise from east, pitch down positive, roll right side down positive).
struct Euler {
  float yaw_rad = 0, pitch_rad = 0, roll_rad = 0;
};
[[nodiscard]] inline Euler euler(const Quaternion& q) {
  const Matrix3 r = q.matrix();
  const float horizontal = base::sqrt(r(0, 0) * r(0, 0) + r(1, 0) * r(1, 0));
  return {.yaw_rad = base::atan2(r(1, 0), r(0, 0)),
          .pitch_rad = base::atan2(-r(2, 0), horizontal),
          .roll_rad = base::atan2(r(2, 1), r(2, 2))};
}
[[nodiscard]] inline Quaternion from_euler(const Euler& e) {
  return exp_quaternion({0.0F, 0.0F, e.yaw_rad}) * exp_quaternion({0.0F, e.pitch_rad, 0.0F}) *
         exp_quaternion({e.roll_rad, 0.0F, 0.0F});
}

}  // namespace tetap::nav
