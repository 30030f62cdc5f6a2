// SPDX-License-Identifier: Apache-2.0
// Pose of a ground robot: x east, y north (REP-103), yaw 0 = east, counter-clockwise. Error state (dx, dy, dyaw), in n.
#pragma once

#include "tetap/base/anchored.hpp"
#include "tetap/base/math.hpp"
#include "tetap/filter/state.hpp"

namespace tetap::model {

struct PlanarPose {
  using Scalar = float;
  static constexpr int kErrors = 3, kAngle = 2;

  base::Anchored x;
  base::Anchored y;
  float yaw_rad = 0;  ///< in [-pi, pi]

  [[nodiscard]] PlanarPose plus(const filter::Vector<float, 3>& dx) const {
    return {.x = x.plus(dx(0)), .y = y.plus(dx(1)), .yaw_rad = base::wrap_angle(yaw_rad + dx(2))};
  }
  [[nodiscard]] filter::Vector<float, 3> minus(const PlanarPose& other) const {
    return {x.minus(other.x), y.minus(other.y), base::wrap_angle(yaw_rad - other.yaw_rad)};
  }
  [[nodiscard]] constexpr bool finite() const { return base::is_finite(x.offset_m + y.offset_m + yaw_rad); }
};

}  // namespace tetap::model
