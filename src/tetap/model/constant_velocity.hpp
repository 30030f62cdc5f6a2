// SPDX-License-Identifier: Apache-2.0
// Constant velocity in the plane, state (x, vx, y, vy), driven by white acceleration. This is the piecewise-constant
// form, q in (m/s^2)^2 (Bar-Shalom, Li, Kirubarajan 2001, eq. 6.3.2-4); eq. 6.2.2-12 is the discretised continuous one,
// q dt^3/3.
#pragma once

#include "tetap/filter/kalman.hpp"

namespace tetap::model {

template <class Scalar>
struct ConstantVelocity {
  Scalar dt_s = 0;
  Scalar acceleration_variance = 0;  ///< (m/s^2)^2 per axis, constant within a step

  using State = filter::VectorState<Scalar, 4>;

  [[nodiscard]] State predict(const State& x) const {
    State next = x;
    next.value(0) += dt_s * x.value(1);
    next.value(2) += dt_s * x.value(3);
    return next;
  }
  using Jacobian = filter::UnitPlus<Scalar, 4, filter::Entry{0, 1}, filter::Entry{2, 3}>;
  using Noise = filter::SparseSymmetric<Scalar, 4, filter::Entry{0, 0}, filter::Entry{0, 1}, filter::Entry{1, 1},
                                        filter::Entry{2, 2}, filter::Entry{2, 3}, filter::Entry{3, 3}>;

  /// All at once, with the zeros and ones of F and Q in their types.
  [[nodiscard]] filter::SparseStep<State, Jacobian, Noise> sparse_step(const State& x) const {
    const Scalar dt2 = dt_s * dt_s, v = acceleration_variance * dt2;
    const Scalar xx = v * dt2 * Scalar(0.25F), xv = v * dt_s * Scalar(0.5F);
    return {.x = predict(x), .f = {{dt_s, dt_s}}, .q = {{xx, xv, v, xx, xv, v}}};
  }
  [[nodiscard]] filter::Matrix<Scalar, 4, 4> jacobian(const State&) const {
    filter::Matrix<Scalar, 4, 4> f = filter::Matrix<Scalar, 4, 4>::Identity();
    f(0, 1) = dt_s;
    f(2, 3) = dt_s;
    return f;
  }
  [[nodiscard]] filter::Symmetric<Scalar, 4> noise(const State&) const {
    const Scalar dt2 = dt_s * dt_s;
    filter::Symmetric<Scalar, 4> q;
    for (int axis = 0; axis < 4; axis += 2) {
      q(axis, axis) = acceleration_variance * dt2 * dt2 * Scalar(0.25F);
      q(axis, axis + 1) = acceleration_variance * dt2 * dt_s * Scalar(0.5F);
      q(axis + 1, axis + 1) = acceleration_variance * dt2;
    }
    return q;
  }
};

}  // namespace tetap::model
