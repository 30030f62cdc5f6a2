// SPDX-License-Identifier: Apache-2.0
// The planar motion every wheeled model ends in: a path length ds and a turn dyaw along a circular arc, with their
// covariance. Midpoint form: Siegwart, Nourbakhsh, Scaramuzza 2011, eq. 5.7-5.9. The exact arc replaces ds by the chord
// ds sin(h)/h, h = dyaw/2.
#pragma once

#include "tetap/base/math.hpp"
#include "tetap/base/multiply_add.hpp"
#include "tetap/filter/structure.hpp"
#include "tetap/model/planar_pose.hpp"

#include <array>
#include <cstdint>

namespace tetap::model {

enum class Arc : std::uint8_t { kMidpoint, kExact };

/// F of a planar motion: the error in yaw swings the chord.
using YawSwing = filter::UnitPlus<float, 3, filter::Entry{0, 2}, filter::Entry{1, 2}>;

struct PlanarIncrement {
  static constexpr std::array<int, 1> kNonlinear{2};  ///< the position is only carried along

  float ds_m = 0;
  float dyaw_rad = 0;
  float var_ds = 0;       ///< m^2
  float cov_ds_dyaw = 0;  ///< m rad
  float var_dyaw = 0;     ///< rad^2
  Arc arc = Arc::kExact;

  /// The pose after the increment.
  [[nodiscard]] PlanarPose predict(const PlanarPose& from) const {
    const Terms t = terms(from.yaw_rad);
    return predict(from, ds_m * (t.chord * t.direction.cos), ds_m * (t.chord * t.direction.sin));
  }
  /// F: the error in yaw swings the chord.
  [[nodiscard]] filter::Matrix<float, 3, 3> jacobian(const PlanarPose& from) const { return step(from).f; }
  /// Q = G cov(ds, dyaw) G^T with G = d pose / d (ds, dyaw).
  [[nodiscard]] filter::Symmetric<float, 3> noise(const PlanarPose& from) const { return step(from).q; }
  /// The same as step(), with the zeros and ones of F in its type.
  [[nodiscard]] filter::SparseStep<PlanarPose, YawSwing> sparse_step(const PlanarPose& from) const {
    const Terms t = terms(from.yaw_rad);
    const float dx_m = ds_m * (t.chord * t.direction.cos), dy_m = ds_m * (t.chord * t.direction.sin);
    return {.x = predict(from, dx_m, dy_m), .f = {{-dy_m, dx_m}}, .q = noise(t, dx_m, dy_m)};
  }
  [[nodiscard]] filter::Step<PlanarPose> step(const PlanarPose& from) const {
    const auto sparse = sparse_step(from);
    return {.x = sparse.x, .f = sparse.f.dense(), .q = sparse.q};
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
  /// Moved by the chord.
  [[nodiscard]] PlanarPose predict(const PlanarPose& from, float dx_m, float dy_m) const {
    return {.x = from.x.plus(dx_m), .y = from.y.plus(dy_m), .yaw_rad = base::wrap_angle(from.yaw_rad + dyaw_rad)};
  }
  [[nodiscard]] filter::Symmetric<float, 3> noise(const Terms& t, float dx_m, float dy_m) const {
    // G = (a, c; b, d; 0, 1)
    const float a = t.chord * t.direction.cos, b = t.chord * t.direction.sin, bend_m = ds_m * t.chord_slope;
    const float c = 0.5F * (bend_m * t.direction.cos - dy_m), d = 0.5F * (bend_m * t.direction.sin + dx_m);
    filter::Symmetric<float, 3> q;
    using base::add_product;
    const float q02 = add_product(cov_ds_dyaw * a, var_dyaw, c), q12 = add_product(cov_ds_dyaw * b, var_dyaw, d);
    const float column = add_product(var_ds * b, cov_ds_dyaw, d);
    q(0, 2) = q02;
    q(1, 2) = q12;
    q(2, 2) = var_dyaw;
    q(0, 0) = add_product(a * add_product(var_ds * a, cov_ds_dyaw, c), c, q02);
    q(0, 1) = add_product(a * column, c, q12);
    q(1, 1) = add_product(b * column, d, q12);
    return q;
  }
};

}  // namespace tetap::model
