// SPDX-License-Identifier: Apache-2.0
// Bearing alone to a target, from a sensor whose place is known (Bar-Shalom, Li, Kirubarajan 2001, sec. 3.7).
#pragma once

#include "tetap/model/kinematics.hpp"

#include <array>

namespace tetap::model {

template <class State>
struct TargetBearing {
  using Scalar = typename State::Scalar;
  static constexpr int kDimension = 1;
  static constexpr auto kTouches = filter::all_indices<State::kErrors>();
  static constexpr std::array<int, 1> kAngles{0};

  Scalar bearing_rad = 0;
  Scalar sigma_bearing_rad = 0;
  Scalar sensor_x_m = 0;
  Scalar sensor_y_m = 0;

  [[nodiscard]] filter::Vector<Scalar, 1> predict(const State& x) const {
    const TargetSight<Scalar> sight(kinematics(x), sensor_x_m, sensor_y_m);
    return filter::Vector<Scalar, 1>{sight.bearing_rad()};
  }
  [[nodiscard]] filter::Vector<Scalar, 1> residual(const filter::Vector<Scalar, 1>& z_hat) const {
    return filter::Vector<Scalar, 1>{filter::wrapped(bearing_rad - z_hat(0))};
  }
  [[nodiscard]] filter::Vector<Scalar, 1> noise() const {
    return filter::Vector<Scalar, 1>{sigma_bearing_rad * sigma_bearing_rad};
  }
  [[nodiscard]] filter::Matrix<Scalar, 1, State::kErrors> jacobian(const State& x) const {
    filter::Matrix<Scalar, 1, 4> rows;
    const TargetSight<Scalar> sight(kinematics(x), sensor_x_m, sensor_y_m);
    rows.row(0) = sight.bearing_row();
    return rows.lazyProduct(kinematics_jacobian(x));
  }
};

}  // namespace tetap::model
