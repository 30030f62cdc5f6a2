// SPDX-License-Identifier: Apache-2.0
// Vectors of three doubles, for the doctor's comparisons.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

namespace tetap::doctor {

using Vector3 = std::array<double, 3>;
using Matrix3 = std::array<Vector3, 3>;  ///< rows

[[nodiscard]] inline double dot(const Vector3& a, const Vector3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
[[nodiscard]] inline double norm(const Vector3& a) { return std::sqrt(dot(a, a)); }
[[nodiscard]] inline Vector3 scaled(double k, const Vector3& a) { return {k * a[0], k * a[1], k * a[2]}; }
[[nodiscard]] inline Vector3 sum(const Vector3& a, const Vector3& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }
[[nodiscard]] inline Vector3 cross(const Vector3& a, const Vector3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
[[nodiscard]] inline Vector3 unit(const Vector3& a) {
  const double length = norm(a);
  return length > 0 ? scaled(1 / length, a) : a;
}
[[nodiscard]] inline Vector3 rotated(const Matrix3& rows, const Vector3& a) {
  return {dot(rows[0], a), dot(rows[1], a), dot(rows[2], a)};
}
[[nodiscard]] inline Matrix3 transposed(const Matrix3& rows) {
  return {Vector3{rows[0][0], rows[1][0], rows[2][0]}, Vector3{rows[0][1], rows[1][1], rows[2][1]},
          Vector3{rows[0][2], rows[1][2], rows[2][2]}};
}
/// a turned by the rotation vector (Rodrigues).
[[nodiscard]] inline Vector3 turned(const Vector3& rotation_rad, const Vector3& a) {
  const double angle = norm(rotation_rad);
  if (angle < 1e-12) return a;
  const Vector3 axis = scaled(1 / angle, rotation_rad);
  const double c = std::cos(angle), s = std::sin(angle);
  return sum(sum(scaled(c, a), scaled(s, cross(axis, a))), scaled((1 - c) * dot(axis, a), axis));
}

}  // namespace tetap::doctor
