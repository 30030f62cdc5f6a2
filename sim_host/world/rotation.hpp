// SPDX-License-Identifier: Apache-2.0
// Vectors and rotations of the world, in double. Frames: n = east north up of a place, b = forward left up.
// R_nb = Rz(yaw) Ry(pitch) Rx(roll): a positive pitch is nose down, a positive roll is left side up.
#pragma once

#include "sim_host/world/math.hpp"

#include <array>
#include <cstddef>

namespace tetap::sim {

using Vector3 = std::array<double, 3>;

[[nodiscard]] constexpr Vector3 operator+(const Vector3& a, const Vector3& b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
[[nodiscard]] constexpr Vector3 operator-(const Vector3& a, const Vector3& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
[[nodiscard]] constexpr Vector3 operator*(double k, const Vector3& v) { return {k * v[0], k * v[1], k * v[2]}; }
[[nodiscard]] constexpr Vector3 cross(const Vector3& u, const Vector3& v) {
  return {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
}

/// A 3 x 3 matrix, row by row.
struct Matrix3 {
  std::array<double, 9> m{1, 0, 0, 0, 1, 0, 0, 0, 1};

  [[nodiscard]] constexpr Vector3 operator*(const Vector3& v) const {
    return {m[0] * v[0] + m[1] * v[1] + m[2] * v[2], m[3] * v[0] + m[4] * v[1] + m[5] * v[2],
            m[6] * v[0] + m[7] * v[1] + m[8] * v[2]};
  }
  [[nodiscard]] constexpr Matrix3 operator*(const Matrix3& b) const {
    Matrix3 product;
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = 0; j < 3; ++j)
        product.m[3 * i + j] = m[3 * i] * b.m[j] + m[3 * i + 1] * b.m[3 + j] + m[3 * i + 2] * b.m[6 + j];
    return product;
  }
  [[nodiscard]] constexpr Matrix3 transposed() const {
    return {{m[0], m[3], m[6], m[1], m[4], m[7], m[2], m[5], m[8]}};
  }
  /// By cofactors; the determinant must not be 0.
  [[nodiscard]] constexpr Matrix3 inverse() const {
    const Vector3 a{m[0], m[1], m[2]}, b{m[3], m[4], m[5]}, c{m[6], m[7], m[8]};
    const Vector3 x = cross(b, c), y = cross(c, a), z = cross(a, b);
    const double one = 1 / (a[0] * x[0] + a[1] * x[1] + a[2] * x[2]);
    return {
        {one * x[0], one * y[0], one * z[0], one * x[1], one * y[1], one * z[1], one * x[2], one * y[2], one * z[2]}};
  }
};

/// R_nb of an attitude (roll, pitch, yaw).
[[nodiscard]] inline Matrix3 rotation(const Vector3& attitude_rad) {
  const Direction r = direction(attitude_rad[0]), p = direction(attitude_rad[1]), w = direction(attitude_rad[2]);
  return {{w.cos * p.cos, w.cos * p.sin * r.sin - w.sin * r.cos, w.cos * p.sin * r.cos + w.sin * r.sin, w.sin * p.cos,
           w.sin * p.sin * r.sin + w.cos * r.cos, w.sin * p.sin * r.cos - w.cos * r.sin, -p.sin, p.cos * r.sin,
           p.cos * r.cos}};
}

/// Roll, pitch, yaw of R_nb; the pitch is not near +-90 deg.
[[nodiscard]] inline Vector3 attitude(const Matrix3& r_nb) {
  const auto& m = r_nb.m;
  return {sim::atan2(m[7], m[8]), sim::atan2(-m[6], sim::sqrt(m[7] * m[7] + m[8] * m[8])), sim::atan2(m[3], m[0])};
}

/// R_nb v: from b into n.
[[nodiscard]] inline Vector3 to_level(const Vector3& attitude_rad, const Vector3& v_b) {
  return rotation(attitude_rad) * v_b;
}
/// R_nb^T v: from n into b.
[[nodiscard]] inline Vector3 to_body(const Vector3& attitude_rad, const Vector3& v_n) {
  return rotation(attitude_rad).transposed() * v_n;
}

}  // namespace tetap::sim
