// SPDX-License-Identifier: Apache-2.0
// The planar motion every wheeled model ends in: a path length ds and a turn dyaw along a circular arc, with their
// covariance. Midpoint form: Siegwart, Nourbakhsh, Scaramuzza 2011, eq. 5.7-5.9. The exact arc replaces ds by the chord
// ds sin(h)/h, h = dyaw/2.
#pragma once

#include "base/math.hpp"
#include "model/planar_pose.hpp"

#include <array>
#include <cstdint>

namespace tetap::model {

enum class Arc : std::uint8_t { kMidpoint, kExact };

struct PlanarIncrement {
  static constexpr std::array<int, 1> kNonlinear{2};  ///< the position is only carried along

  float ds_m = 0;
  float dyaw_rad = 0;
  float var_ds = 0;       ///< m^2
  float cov_ds_dyaw = 0;  ///< m rad
  float var_dyaw = 0;     ///< rad^2
  Arc arc = Arc::kExact;

  /// The pose after the increment.
  [[nodiscard]] PlanarPose predict(const PlanarPose& from) const { return predict(from, terms(from.yaw_rad)); }
  /// F: the error in yaw swings the chord.
  [[nodiscard]] filter::Matrix<float, 3, 3> jacobian(const PlanarPose& from) const {
    return jacobian(terms(from.yaw_rad));
  }
  /// Q = G cov(ds, dyaw) G^T with G = d pose / d (ds, dyaw).
  [[nodiscard]] filter::Symmetric<float, 3> noise(const PlanarPose& from) const { return noise(terms(from.yaw_rad)); }
  [[nodiscard]] filter::Step<PlanarPose> step(const PlanarPose& from) const {
    const Terms t = terms(from.yaw_rad);
    return {.x = predict(from, t), .f = jacobian(t), .q = noise(t)};
  }

 private:
  struct Terms {
    base::SinCos direction;  ///< direction of the chord: yaw + dyaw/2
    float chord = 1;         ///< chord over arc length, sin(h)/h
    float chord_slope = 0;   ///< its derivative by h
  };
  [[nodiscard]] Terms terms(float yaw_rad) const {
    const float h = 0.5F * dyaw_rad;
    Terms t{.direction = base::sincos(yaw_rad + h)};
    if (arc == Arc::kMidpoint) return t;
    const float h2 = h * h;
    if (h2 < 0.01F) {  // next terms: h^6/5040 < 2e-10 and 2 h^5/... < 1e-8: below float's rounding
      t.chord = 1.0F - h2 * (1.0F / 6.0F) * (1.0F - h2 * (1.0F / 20.0F));
      t.chord_slope = -h * (1.0F / 3.0F) * (1.0F - h2 * (1.0F / 10.0F));
    } else {
      const base::SinCos half = base::sincos(h);
      t.chord = half.sin / h;
      t.chord_slope = (half.cos - t.chord) / h;
    }
    return t;
  }
  [[nodiscard]] PlanarPose predict(const PlanarPose& from, const Terms& t) const {
    return {.x = from.x.plus(ds_m * t.chord * t.direction.cos),
            .y = from.y.plus(ds_m * t.chord * t.direction.sin),
            .yaw_rad = base::wrap_angle(from.yaw_rad + dyaw_rad)};
  }
  [[nodiscard]] filter::Matrix<float, 3, 3> jacobian(const Terms& t) const {
    filter::Matrix<float, 3, 3> f = filter::Matrix<float, 3, 3>::Identity();
    f(0, 2) = -ds_m * t.chord * t.direction.sin;
    f(1, 2) = ds_m * t.chord * t.direction.cos;
    return f;
  }
  [[nodiscard]] filter::Symmetric<float, 3> noise(const Terms& t) const {
    filter::Matrix<float, 3, 2> g;
    g(0, 0) = t.chord * t.direction.cos;
    g(1, 0) = t.chord * t.direction.sin;
    g(2, 0) = 0.0F;
    g(0, 1) = 0.5F * ds_m * (t.chord_slope * t.direction.cos - t.chord * t.direction.sin);
    g(1, 1) = 0.5F * ds_m * (t.chord_slope * t.direction.sin + t.chord * t.direction.cos);
    g(2, 1) = 1.0F;
    filter::Matrix<float, 2, 3> cov_gt;  // cov(ds, dyaw) G^T
    filter::Symmetric<float, 3> q;
#pragma GCC unroll 16
    for (int c = 0; c < 3; ++c) {
      cov_gt(0, c) = var_ds * g(c, 0) + cov_ds_dyaw * g(c, 1);
      cov_gt(1, c) = cov_ds_dyaw * g(c, 0) + var_dyaw * g(c, 1);
#pragma GCC unroll 16
      for (int r = 0; r <= c; ++r) q(r, c) = g(r, 0) * cov_gt(0, c) + g(r, 1) * cov_gt(1, c);
    }
    return q;
  }
};

}  // namespace tetap::model
