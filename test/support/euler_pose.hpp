// SPDX-License-Identifier: Apache-2.0
// A vehicle in the plane as textbooks write it (Thrun, Burgard, Fox 2005, sec. 3.3). State (x, y, yaw) as three
// numbers, one Euler step of a unicycle, additive noise, range and bearing to one landmark. Filters are compared on it,
// and tools/count counts it.
#pragma once

#include "tetap/base/math_double.hpp"
#include "tetap/filter/state.hpp"
#include "tetap/filter/wrap.hpp"

#include <array>

namespace tetap::test {

template <class Scalar>
struct EulerUnicycle {
  using State = filter::VectorState<Scalar, 3>;
  static constexpr std::array<int, 1> kNonlinear{2};

  Scalar ds_m = 0;
  Scalar dyaw_rad = 0;
  std::array<Scalar, 3> variance{};  ///< added per step

  [[nodiscard]] State predict(const State& from) const {
    const auto heading = base::sincos(from.value(2));
    return {{from.value(0) + ds_m * heading.cos, from.value(1) + ds_m * heading.sin, from.value(2) + dyaw_rad}};
  }
  [[nodiscard]] filter::Matrix<Scalar, 3, 3> jacobian(const State& from) const {
    const auto heading = base::sincos(from.value(2));
    filter::Matrix<Scalar, 3, 3> f = filter::Matrix<Scalar, 3, 3>::Identity();
    f(0, 2) = -ds_m * heading.sin;
    f(1, 2) = ds_m * heading.cos;
    return f;
  }
  [[nodiscard]] filter::Symmetric<Scalar, 3> noise(const State&) const {
    return filter::Symmetric<Scalar, 3>::diagonal(variance);
  }
};

template <class Scalar>
struct EulerSight {
  using State = filter::VectorState<Scalar, 3>;
  static constexpr int kDimension = 2;
  static constexpr std::array<int, 3> kTouches{0, 1, 2};
  static constexpr std::array<int, 2> kNonlinear{0, 1};
  static constexpr std::array<int, 1> kLinear{2};
  static constexpr std::array<int, 1> kAngles{1};

  Scalar range_m = 0;
  Scalar bearing_rad = 0;
  filter::Vector<Scalar, 2> variance;
  Scalar landmark_x_m = 60;
  Scalar landmark_y_m = 20;

  struct Line {
    Scalar dx_m, dy_m, range_m, yaw_rad;
  };
  [[nodiscard]] Line observe(const State& at) const {
    const Scalar dx = landmark_x_m - at.value(0);
    const Scalar dy = landmark_y_m - at.value(1);
    return {dx, dy, base::sqrt(dx * dx + dy * dy), at.value(2)};
  }
  [[nodiscard]] filter::Vector<Scalar, 2> value(const Line& to) const {
    return {to.range_m, base::atan2(to.dy_m, to.dx_m) - to.yaw_rad};
  }
  [[nodiscard]] filter::Vector<Scalar, 2> difference(const Line& to, const Line& from) const {
    const Scalar turn =
        filter::angle_between(from.dx_m * to.dy_m - from.dy_m * to.dx_m, from.dx_m * to.dx_m + from.dy_m * to.dy_m);
    return {to.range_m - from.range_m, turn - (to.yaw_rad - from.yaw_rad)};
  }
  [[nodiscard]] filter::Vector<Scalar, 2> predict(const State& at) const { return value(observe(at)); }
  [[nodiscard]] filter::Vector<Scalar, 2> residual(const filter::Vector<Scalar, 2>& z_hat) const {
    return {range_m - z_hat(0), filter::wrapped(bearing_rad - z_hat(1))};
  }
  [[nodiscard]] filter::Vector<Scalar, 2> noise() const { return variance; }
  [[nodiscard]] filter::Matrix<Scalar, 2, 1> slopes() const { return {Scalar{0}, Scalar{-1}}; }
  [[nodiscard]] filter::Matrix<Scalar, 2, 3> jacobian(const State& at) const {
    const Scalar dx = landmark_x_m - at.value(0);
    const Scalar dy = landmark_y_m - at.value(1);
    const Scalar inverse = Scalar{1} / base::sqrt(dx * dx + dy * dy);
    const Scalar cx = dx * inverse;
    const Scalar cy = dy * inverse;
    filter::Matrix<Scalar, 2, 3> h;
    h << -cx, -cy, Scalar{0}, cy * inverse, -cx * inverse, Scalar{-1};
    return h;
  }
};

}  // namespace tetap::test
