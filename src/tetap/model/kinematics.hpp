// SPDX-License-Identifier: Apache-2.0
// Position and velocity of a tracked target, from any state of the motion models, and the line of sight of a sensor
// that watches it.
#pragma once

#include "tetap/model/ctrv.hpp"

namespace tetap::model {

/// (x m, y m, vx m/s, vy m/s) in the frame of the state.
template <class Scalar>
using Kinematics = filter::Vector<Scalar, 4>;

/// Constant velocity: (x, vx, y, vy).
template <class Scalar>
[[nodiscard]] Kinematics<Scalar> kinematics(const filter::VectorState<Scalar, 4>& x) {
  return {x.value(0), x.value(2), x.value(1), x.value(3)};
}
template <class Scalar>
[[nodiscard]] filter::Matrix<Scalar, 4, 4> kinematics_jacobian(const filter::VectorState<Scalar, 4>&) {
  filter::Matrix<Scalar, 4, 4> j = filter::Matrix<Scalar, 4, 4>::Zero();
  j(0, 0) = j(1, 2) = j(2, 1) = j(3, 3) = Scalar{1};
  return j;
}

/// Constant acceleration: (x, vx, ax, y, vy, ay).
template <class Scalar>
[[nodiscard]] Kinematics<Scalar> kinematics(const filter::VectorState<Scalar, 6>& x) {
  return {x.value(0), x.value(3), x.value(1), x.value(4)};
}
template <class Scalar>
[[nodiscard]] filter::Matrix<Scalar, 4, 6> kinematics_jacobian(const filter::VectorState<Scalar, 6>&) {
  filter::Matrix<Scalar, 4, 6> j = filter::Matrix<Scalar, 4, 6>::Zero();
  j(0, 0) = j(1, 3) = j(2, 1) = j(3, 4) = Scalar{1};
  return j;
}

/// Constant turn rate and velocity: (x, y, v, yaw, yaw rate).
template <class Scalar>
[[nodiscard]] Kinematics<Scalar> kinematics(const CtrvState<Scalar>& x) {
  const auto heading = base::sincos(x.value(3));
  return {x.value(0), x.value(1), x.value(2) * heading.cos, x.value(2) * heading.sin};
}
template <class Scalar>
[[nodiscard]] filter::Matrix<Scalar, 4, 5> kinematics_jacobian(const CtrvState<Scalar>& x) {
  const auto heading = base::sincos(x.value(3));
  filter::Matrix<Scalar, 4, 5> j = filter::Matrix<Scalar, 4, 5>::Zero();
  j(0, 0) = j(1, 1) = Scalar{1};
  j(2, 2) = heading.cos;
  j(3, 2) = heading.sin;
  j(2, 3) = -x.value(2) * heading.sin;
  j(3, 3) = x.value(2) * heading.cos;
  return j;
}

/// Line of sight from a sensor at rest to a target, with what range, bearing and range rate share.
template <class Scalar>
struct TargetSight {
  Scalar dx_m, dy_m, vx_mps, vy_mps, range_m;

  TargetSight(const Kinematics<Scalar>& target, Scalar sensor_x_m, Scalar sensor_y_m)
      : dx_m(target(0) - sensor_x_m), dy_m(target(1) - sensor_y_m), vx_mps(target(2)), vy_mps(target(3)) {
    // One centimetre: nearer than any target can be seen, and far enough from zero for the divisions below.
    const Scalar square = dx_m * dx_m + dy_m * dy_m;
    range_m = base::sqrt(square > Scalar(1e-4F) ? square : Scalar(1e-4F));
  }

  [[nodiscard]] Scalar bearing_rad() const { return base::atan2(dy_m, dx_m); }
  [[nodiscard]] Scalar range_rate_mps() const { return (dx_m * vx_mps + dy_m * vy_mps) / range_m; }
  /// d / d (x, y, vx, vy) of range, bearing, range rate.
  [[nodiscard]] filter::Matrix<Scalar, 1, 4> range_row() const {
    return {dx_m / range_m, dy_m / range_m, Scalar{0}, Scalar{0}};
  }
  [[nodiscard]] filter::Matrix<Scalar, 1, 4> bearing_row() const {
    const Scalar square = range_m * range_m;
    return {-dy_m / square, dx_m / square, Scalar{0}, Scalar{0}};
  }
  [[nodiscard]] filter::Matrix<Scalar, 1, 4> range_rate_row() const {
    const Scalar across = (vx_mps * dy_m - vy_mps * dx_m) / (range_m * range_m * range_m);
    return {dy_m * across, -dx_m * across, dx_m / range_m, dy_m / range_m};
  }
};

}  // namespace tetap::model
