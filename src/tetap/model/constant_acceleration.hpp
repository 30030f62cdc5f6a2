// SPDX-License-Identifier: Apache-2.0
// Constant acceleration in the plane, state (x, vx, ax, y, vy, ay). White increments of the acceleration drive it
// (Bar-Shalom, Li, Kirubarajan 2001, sec. 6.3.3: discrete Wiener process acceleration model).
#pragma once

#include "tetap/filter/state.hpp"

namespace tetap::model {

template <class Scalar>
struct ConstantAcceleration {
  Scalar dt_s = 0;
  Scalar increment_variance = 0;  ///< (m/s^2)^2 per axis: of the change of acceleration within a step

  using State = filter::VectorState<Scalar, 6>;

  [[nodiscard]] State predict(const State& x) const { return {jacobian(x).lazyProduct(x.value)}; }
  [[nodiscard]] filter::Matrix<Scalar, 6, 6> jacobian(const State&) const {
    filter::Matrix<Scalar, 6, 6> f = filter::Matrix<Scalar, 6, 6>::Identity();
    for (int axis = 0; axis < 6; axis += 3) {
      f(axis, axis + 1) = dt_s;
      f(axis, axis + 2) = Scalar(0.5F) * dt_s * dt_s;
      f(axis + 1, axis + 2) = dt_s;
    }
    return f;
  }
  /// Gamma Gamma^T times the variance, Gamma = (dt^2/2, dt, 1).
  [[nodiscard]] filter::Symmetric<Scalar, 6> noise(const State&) const {
    const filter::Vector<Scalar, 3> gamma{Scalar(0.5F) * dt_s * dt_s, dt_s, Scalar{1}};
    filter::Symmetric<Scalar, 6> q;
    for (int axis = 0; axis < 6; axis += 3)
      for (int c = 0; c < 3; ++c)
        for (int r = 0; r <= c; ++r) q(axis + r, axis + c) = increment_variance * gamma(r) * gamma(c);
    return q;
  }
};

}  // namespace tetap::model
