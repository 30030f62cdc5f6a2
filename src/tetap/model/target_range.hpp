// SPDX-License-Identifier: Apache-2.0
// Range alone to a target, from a sensor whose place is known (Bar-Shalom, Li, Kirubarajan 2001, ch. 10).
#pragma once

#include "tetap/model/kinematics.hpp"

#include <array>

namespace tetap::model {

template <class State>
struct TargetRange {
  using Scalar = typename State::Scalar;
  static constexpr int kDimension = 1;
  static constexpr auto kTouches = filter::all_indices<State::kErrors>();

  Scalar range_m = 0;
  Scalar sigma_range_m = 0;
  Scalar sensor_x_m = 0;
  Scalar sensor_y_m = 0;

  [[nodiscard]] filter::Vector<Scalar, 1> predict(const State& x) const {
    const TargetSight<Scalar> sight(kinematics(x), sensor_x_m, sensor_y_m);
    return filter::Vector<Scalar, 1>{sight.range_m};
  }
  [[nodiscard]] filter::Vector<Scalar, 1> residual(const filter::Vector<Scalar, 1>& z_hat) const {
    return filter::Vector<Scalar, 1>{range_m - z_hat(0)};
  }
  [[nodiscard]] filter::Vector<Scalar, 1> noise() const {
    return filter::Vector<Scalar, 1>{sigma_range_m * sigma_range_m};
  }
  [[nodiscard]] filter::Matrix<Scalar, 1, State::kErrors> jacobian(const State& x) const {
    filter::Matrix<Scalar, 1, 4> rows;
    const TargetSight<Scalar> sight(kinematics(x), sensor_x_m, sensor_y_m);
    rows.row(0) = sight.range_row();
    return rows.lazyProduct(kinematics_jacobian(x));
  }
};

}  // namespace tetap::model
