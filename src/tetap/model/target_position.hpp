// SPDX-License-Identifier: Apache-2.0
// Position of a target, of a lidar or a camera above the scene.
#pragma once

#include "tetap/model/kinematics.hpp"

#include <array>

namespace tetap::model {

template <class State>
struct TargetPosition {
  using Scalar = typename State::Scalar;
  static constexpr int kDimension = 2;
  static constexpr auto kTouches = filter::all_indices<State::kErrors>();

  Scalar x_m = 0;
  Scalar y_m = 0;
  Scalar sigma_m = 0;

  [[nodiscard]] filter::Vector<Scalar, 2> predict(const State& x) const {
    const Kinematics<Scalar> k = kinematics(x);
    return {k(0), k(1)};
  }
  [[nodiscard]] filter::Vector<Scalar, 2> residual(const filter::Vector<Scalar, 2>& z_hat) const {
    return {x_m - z_hat(0), y_m - z_hat(1)};
  }
  [[nodiscard]] filter::Vector<Scalar, 2> noise() const { return {sigma_m * sigma_m, sigma_m * sigma_m}; }
  [[nodiscard]] filter::Matrix<Scalar, 2, State::kErrors> jacobian(const State& x) const {
    filter::Matrix<Scalar, 2, 4> rows;
    rows.setZero();
    rows(0, 0) = rows(1, 1) = Scalar{1};
    return rows.lazyProduct(kinematics_jacobian(x));
  }
};

}  // namespace tetap::model
