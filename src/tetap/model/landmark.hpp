// SPDX-License-Identifier: Apache-2.0
// A landmark at a known place, as seen from a sensor on the body.
#pragma once

#include "tetap/base/math.hpp"
#include "tetap/model/planar_pose.hpp"

namespace tetap::model {

struct Landmark {
  base::Anchored x;
  base::Anchored y;
};

/// Place of the sensor on the body, and its turn there (counter-clockwise).
struct PlanarMounting {
  float x_b_m = 0;
  float y_b_m = 0;
  float yaw_rad = 0;

  [[nodiscard]] constexpr bool at_origin() const { return base::bits(x_b_m) << 1 == 0 && base::bits(y_b_m) << 1 == 0; }
};

/// Line of sight from the sensor to a landmark in n, with what range and bearing models share.
struct Sight {
  float dx_m = 0;
  float dy_m = 0;
  float range2_m2 = 0;
  float lever_x_m = 0;  ///< the sensor's offset from the body's origin, turned into n
  float lever_y_m = 0;

  Sight(const PlanarPose& pose, const Landmark& landmark, const PlanarMounting& mounting) {
    if (!mounting.at_origin()) {
      const base::SinCos heading = base::sincos(pose.yaw_rad);
      lever_x_m = heading.cos * mounting.x_b_m - heading.sin * mounting.y_b_m;
      lever_y_m = heading.sin * mounting.x_b_m + heading.cos * mounting.y_b_m;
    }
    dx_m = landmark.x.minus(pose.x) - lever_x_m;
    dy_m = landmark.y.minus(pose.y) - lever_y_m;
    // One centimetre: nearer than any landmark can be seen, and far enough from zero for the divisions of the
    // Jacobians.
    const float square = dx_m * dx_m + dy_m * dy_m;
    range2_m2 = square > 1e-4F ? square : 1e-4F;
  }

  [[nodiscard]] float range_m() const { return base::sqrt(range2_m2); }
  /// 1 / range, shared by the rows below.
  [[nodiscard]] float inverse_range() const { return 1.0F / range_m(); }
  [[nodiscard]] float bearing_rad(const PlanarPose& pose, const PlanarMounting& mounting) const {
    return base::wrap_angle(base::atan2(dy_m, dx_m) - pose.yaw_rad - mounting.yaw_rad);
  }
  /// d range / d (x, y, yaw)
  [[nodiscard]] filter::Matrix<float, 1, 3> range_row() const { return range_row(inverse_range()); }
  [[nodiscard]] filter::Matrix<float, 1, 3> range_row(float inverse) const {
    const float x = dx_m * inverse;
    const float y = dy_m * inverse;
    return {-x, -y, x * lever_y_m - y * lever_x_m};
  }
  /// d bearing / d (x, y, yaw)
  [[nodiscard]] filter::Matrix<float, 1, 3> bearing_row() const { return bearing_row(inverse_range()); }
  [[nodiscard]] filter::Matrix<float, 1, 3> bearing_row(float inverse_range) const {
    const float inverse = inverse_range * inverse_range;
    const float x = dx_m * inverse;
    const float y = dy_m * inverse;
    return {y, -x, -(x * lever_x_m + y * lever_y_m) - 1.0F};
  }
};

}  // namespace tetap::model
