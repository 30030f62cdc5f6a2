// SPDX-License-Identifier: Apache-2.0
// Unit quaternions as the attitude filters need them: Hamilton, w first, q_nb turns body axes b into n. Source: Sola
// 2017, "Quaternion kinematics for the error-state Kalman filter", sec. 1 and 2.
#pragma once

#include "tetap/base/math.hpp"
#include "tetap/filter/symmetric.hpp"

namespace tetap::filter {

using Vector3 = Vector<float, 3>;

[[nodiscard]] inline float dot(const Vector3& a, const Vector3& b) { return a(0) * b(0) + a(1) * b(1) + a(2) * b(2); }
[[nodiscard]] inline Vector3 cross(const Vector3& a, const Vector3& b) {
  return {a(1) * b(2) - a(2) * b(1), a(2) * b(0) - a(0) * b(2), a(0) * b(1) - a(1) * b(0)};
}
/// No component is NaN, infinite or above the limit. A square that overflows is above every limit too.
[[nodiscard]] inline bool within(const Vector3& a, float limit) { return dot(a, a) <= limit * limit; }

struct Quaternion {
  float w = 1, x = 0, y = 0, z = 0;

  [[gnu::always_inline]] friend constexpr Quaternion operator*(const Quaternion& a, const Quaternion& b) {
    return {a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z, a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
            a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x, a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w};
  }
  [[nodiscard]] constexpr Quaternion conjugate() const { return {w, -x, -y, -z}; }
  [[nodiscard]] constexpr float norm2() const { return (w * w + x * x) + (y * y + z * z); }
  [[nodiscard]] constexpr Quaternion scaled(float by) const { return {w * by, x * by, y * by, z * by}; }

  /// A Newton step towards |q| = 1: an error e of the norm becomes 1.5 e^2.
  [[nodiscard]] constexpr Quaternion renormalised() const { return scaled(1.5F - 0.5F * norm2()); }
  /// |q| = 1 to rounding, whatever it was before; zero becomes the identity.
  [[nodiscard]] constexpr Quaternion normalised() const {
    const float n2 = norm2();
    return n2 > 0.0F && n2 < base::kInfinity ? scaled(1.0F / base::sqrt(n2)) : Quaternion{};
  }
};

/// The rotation matrix of q by rows: row i holds axis i of n in body axes.
struct Rows {
  Vector3 x, y, z;

  explicit Rows(const Quaternion& q) {
    const float x2 = q.x + q.x, y2 = q.y + q.y, z2 = q.z + q.z;
    const float xx = q.x * x2, yy = q.y * y2, zz = q.z * z2;
    const float xy = q.x * y2, xz = q.x * z2, yz = q.y * z2;
    const float wx = q.w * x2, wy = q.w * y2, wz = q.w * z2;
    x = {1.0F - (yy + zz), xy - wz, xz + wy};
    y = {xy + wz, 1.0F - (xx + zz), yz - wx};
    z = {xz - wy, yz + wx, 1.0F - (xx + yy)};
  }
  [[nodiscard]] Vector3 operator*(const Vector3& v_b) const { return {dot(x, v_b), dot(y, v_b), dot(z, v_b)}; }
};

/// q after a turn by `half` = half a rotation vector, in body axes. Sine and cosine are their series to |half|^5. For a
/// turn of 0.5 rad in one step the error is below 1e-7. The Newton step takes what is left of the norm.
[[nodiscard]] inline Quaternion turned(const Quaternion& q, const Vector3& half) {
  const float h2 = dot(half, half);
  const float sinc = 1.0F - h2 * (1.0F / 6.0F - h2 * (1.0F / 120.0F));
  const float cosine = 1.0F - h2 * (0.5F - h2 * (1.0F / 24.0F - h2 * (1.0F / 720.0F)));
  return (q * Quaternion{cosine, sinc * half(0), sinc * half(1), sinc * half(2)}).renormalised();
}

/// The attitude of least turn that brings `up_b` (any length but zero) to the vertical: heading is left as it falls.
[[nodiscard]] inline Quaternion levelled(const Vector3& up_b) {
  const float length = base::sqrt(dot(up_b, up_b));
  // Nearly upside down the turn of least angle has no axis: half a turn about x first, then the least.
  const bool over = up_b(2) < -0.9F * length;
  const float sign = over ? -1.0F : 1.0F;
  const Quaternion least = Quaternion{length + sign * up_b(2), sign * up_b(1), -up_b(0), 0.0F}.normalised();
  return over ? least * Quaternion{0.0F, 1.0F, 0.0F, 0.0F} : least;
}

}  // namespace tetap::filter
