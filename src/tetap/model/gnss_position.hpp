// SPDX-License-Identifier: Apache-2.0
// A GNSS fix in the local plane: position of the antenna, which sits at a lever arm from the body's origin.
#pragma once

#include "tetap/base/math.hpp"
#include "tetap/model/planar_pose.hpp"

#include <array>

namespace tetap::model {

struct GnssPosition {
  static constexpr int kDimension = 2;
  static constexpr std::array<int, 3> kTouches{0, 1, 2};

  base::Anchored x;   ///< the fix, east
  base::Anchored y;   ///< north
  float sigma_m = 0;  ///< 1 sigma per axis
  float antenna_x_b_m = 0;
  float antenna_y_b_m = 0;

  /// The antenna's place minus the fix: positions are differenced as anchored numbers, so no digit is lost far from the
  /// origin.
  [[nodiscard]] filter::Vector<float, 2> predict(const PlanarPose& pose) const { return linearised(pose).z_hat; }
  [[nodiscard]] filter::Vector<float, 2> residual(const filter::Vector<float, 2>& z_hat) const { return -z_hat; }
  [[nodiscard]] filter::Vector<float, 2> noise() const { return {sigma_m * sigma_m, sigma_m * sigma_m}; }
  [[nodiscard]] filter::Matrix<float, 2, 3> jacobian(const PlanarPose& pose) const { return linearised(pose).h; }
  [[nodiscard]] filter::Linearised<float, 2, 3> linearised(const PlanarPose& pose) const {
    const base::SinCos heading = base::sincos(pose.yaw_rad);
    const float lever_x_n_m = heading.cos * antenna_x_b_m - heading.sin * antenna_y_b_m;
    const float lever_y_n_m = heading.sin * antenna_x_b_m + heading.cos * antenna_y_b_m;
    filter::Linearised<float, 2, 3> at;
    at.z_hat = {pose.x.minus(x) + lever_x_n_m, pose.y.minus(y) + lever_y_n_m};
    at.h << 1.0F, 0.0F, -lever_y_n_m, 0.0F, 1.0F, lever_x_n_m;
    return at;
  }
};

}  // namespace tetap::model
