// SPDX-License-Identifier: Apache-2.0
// Radar at rest: range, bearing and range rate of a target (Bar-Shalom, Li, Kirubarajan 2001, ch. 10).
#pragma once

#include "tetap/model/kinematics.hpp"

#include <array>

namespace tetap::model {

template <class State>
struct Radar {
  using Scalar = typename State::Scalar;
  static constexpr int kDimension = 3;
  static constexpr auto kTouches = filter::all_indices<State::kErrors>();
  static constexpr std::array<int, 1> kAngles{1};

  Scalar range_m = 0;
  Scalar bearing_rad = 0;
  Scalar range_rate_mps = 0;
  Scalar sigma_range_m = 0;
  Scalar sigma_bearing_rad = 0;
  Scalar sigma_range_rate_mps = 0;
  Scalar sensor_x_m = 0;
  Scalar sensor_y_m = 0;

  [[nodiscard]] filter::Vector<Scalar, 3> predict(const State& x) const {
    const TargetSight<Scalar> sight(kinematics(x), sensor_x_m, sensor_y_m);
    return {sight.range_m, sight.bearing_rad(), sight.range_rate_mps()};
  }
  [[nodiscard]] filter::Vector<Scalar, 3> residual(const filter::Vector<Scalar, 3>& z_hat) const {
    return {range_m - z_hat(0), filter::wrapped(bearing_rad - z_hat(1)), range_rate_mps - z_hat(2)};
  }
  [[nodiscard]] filter::Vector<Scalar, 3> noise() const {
    return {sigma_range_m * sigma_range_m, sigma_bearing_rad * sigma_bearing_rad,
            sigma_range_rate_mps * sigma_range_rate_mps};
  }
  [[nodiscard]] filter::Matrix<Scalar, 3, State::kErrors> jacobian(const State& x) const {
    filter::Matrix<Scalar, 3, 4> rows;
    const TargetSight<Scalar> sight(kinematics(x), sensor_x_m, sensor_y_m);
    rows.row(0) = sight.range_row();
    rows.row(1) = sight.bearing_row();
    rows.row(2) = sight.range_rate_row();
    return rows.lazyProduct(kinematics_jacobian(x));
  }
};

}  // namespace tetap::model
