// SPDX-License-Identifier: Apache-2.0
// The judge of inertial navigation: the same physics in double, with Eigen's quaternions, and a body that drives about.
#pragma once

#include "tetap/nav/ins.hpp"

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <random>

namespace tetap::test {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

inline Quaterniond exp_double(const Vector3d& phi) {
  const double angle = phi.norm();
  if (angle < 1e-12) return Quaterniond(1, phi(0) / 2, phi(1) / 2, phi(2) / 2).normalized();
  return Quaterniond(Eigen::AngleAxisd(angle, phi / angle));
}
inline Vector3d log_double(const Quaterniond& q) {
  const Quaterniond up = q.w() < 0 ? Quaterniond(-q.w(), -q.x(), -q.y(), -q.z()) : q;
  const double n = up.vec().norm();
  return n < 1e-12 ? Vector3d(2 * up.vec()) : Vector3d(up.vec() * (2 * std::atan2(n, up.w()) / n));
}
inline Quaterniond as_double(const nav::Quaternion& q) {
  return Quaterniond(static_cast<double>(q.w), static_cast<double>(q.x), static_cast<double>(q.y),
                     static_cast<double>(q.z));
}
inline nav::Quaternion as_float(const Quaterniond& q) {
  return {static_cast<float>(q.w()), static_cast<float>(q.x()), static_cast<float>(q.y()), static_cast<float>(q.z())};
}
/// A place in double as an anchored number: to a nanometre.
inline base::Anchored anchored(double m) {
  const double um = std::floor(m * 1e6 + 0.5);
  return {.anchor_um = static_cast<std::int64_t>(um), .offset_m = static_cast<float>(m - um * 1e-6)};
}
inline double metres(const base::Anchored& a) {
  return static_cast<double>(a.anchor_um) * 1e-6 + static_cast<double>(a.offset_m);
}

struct TrueBody {
  Vector3d p_n = Vector3d::Zero(), v_n = Vector3d::Zero();
  Quaterniond q_nb = Quaterniond::Identity();
  Vector3d b_a = Vector3d::Zero(), b_g = Vector3d::Zero();

  /// The strapdown equations once more.
  void move(const Vector3d& dtheta_b, const Vector3d& dv_b, double dt_s, double gravity) {
    const Vector3d before = v_n;
    v_n += q_nb * dv_b - Vector3d(0, 0, gravity * dt_s);
    q_nb = (q_nb * exp_double(dtheta_b)).normalized();
    p_n += 0.5 * dt_s * (before + v_n);
  }
  /// As the filter's state.
  [[nodiscard]] nav::InsState state() const {
    return {.x = anchored(p_n(0)),
            .y = anchored(p_n(1)),
            .z = anchored(p_n(2)),
            .v_n_mps = v_n.cast<float>(),
            .q_nb = as_float(q_nb),
            .b_a_mps2 = b_a.cast<float>(),
            .b_g_radps = b_g.cast<float>()};
  }
  /// Truth minus estimate, in the filter's error coordinates.
  [[nodiscard]] Eigen::Matrix<double, 15, 1> minus(const nav::InsState& x) const {
    Eigen::Matrix<double, 15, 1> e;
    e << p_n(0) - metres(x.x), p_n(1) - metres(x.y), p_n(2) - metres(x.z), v_n - x.v_n_mps.cast<double>(),
        log_double(q_nb * as_double(x.q_nb).conjugate()), b_a - x.b_a_mps2.cast<double>(),
        b_g - x.b_g_radps.cast<double>();
    return e;
  }
};

inline nav::ImuIncrement increment(const Vector3d& dtheta, const Vector3d& dv, std::int64_t dt_us) {
  return {.dtheta_b_rad = dtheta.cast<float>(), .dv_b_mps = dv.cast<float>(), .dt = {dt_us}};
}

/// To the bit.
inline bool same(const nav::InsState& a, const nav::InsState& b) {
  const auto parameters = [](const nav::InsState& x) {
    std::array<std::uint32_t, 16> bits{};
    std::size_t i = 0;
    for (const base::Anchored& c : {x.x, x.y, x.z}) bits[i++] = base::bits(c.offset_m);
    for (const nav::Vector3& v : {x.v_n_mps, x.b_a_mps2, x.b_g_radps})
      for (int k = 0; k < 3; ++k) bits[i++] = base::bits(v(k));
    for (const float q : {x.q_nb.w, x.q_nb.x, x.q_nb.y, x.q_nb.z}) bits[i++] = base::bits(q);
    return bits;
  };
  return a.x.anchor_um == b.x.anchor_um && a.y.anchor_um == b.y.anchor_um && a.z.anchor_um == b.z.anchor_um &&
         parameters(a) == parameters(b);
}

/// Repeatable normal numbers.
class Normal {
 public:
  explicit Normal(unsigned seed) : random_(seed) {}
  double operator()() { return normal_(random_); }
  Vector3d vector() {
    const double a = (*this)(), b = (*this)(), c = (*this)();
    return {a, b, c};
  }

 private:
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
};

}  // namespace tetap::test
