// SPDX-License-Identifier: Apache-2.0
// The judge of every hand-written Jacobian: central differences on the manifold.
#pragma once

#include "tetap/filter/state.hpp"

namespace tetap::test {

/// d predict / d error state of a motion model, column by column: (f(x + h e) - f(x - h e)) / 2h.
template <class State, class Model>
auto numeric_motion_jacobian(const Model& model, const State& x, typename State::Scalar h) {
  filter::Matrix<typename State::Scalar, State::kErrors, State::kErrors> f;
  for (int c = 0; c < State::kErrors; ++c) {
    filter::Vector<typename State::Scalar, State::kErrors> dx =
        filter::Vector<typename State::Scalar, State::kErrors>::Zero();
    dx(c) = h;
    f.col(c) = model.predict(x.plus(dx)).minus(model.predict(x.plus(-dx))) / (2 * h);
  }
  return f;
}

/// d z_hat / d error state of a measurement model, all states (columns outside kTouches must come out zero).
/// Differences go through residual(), which wraps angles: residual(z-) - residual(z+) would not, so z is moved instead.
template <class State, class Model>
auto numeric_measurement_jacobian(const Model& model, const State& x, typename State::Scalar h) {
  filter::Matrix<typename State::Scalar, Model::kDimension, State::kErrors> jacobian;
  for (int c = 0; c < State::kErrors; ++c) {
    filter::Vector<typename State::Scalar, State::kErrors> dx =
        filter::Vector<typename State::Scalar, State::kErrors>::Zero();
    dx(c) = h;
    // residual(z_hat) = z - z_hat, so the difference of residuals has the sign turned.
    jacobian.col(c) =
        (model.residual(model.predict(x.plus(-dx))) - model.residual(model.predict(x.plus(dx)))) / (2 * h);
  }
  return jacobian;
}

}  // namespace tetap::test
