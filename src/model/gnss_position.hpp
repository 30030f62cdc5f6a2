// SPDX-License-Identifier: Apache-2.0
// A GNSS fix in the local plane: position of the antenna, which sits at a lever arm from the body's origin.
#pragma once

#include "base/math.hpp"
#include "model/planar_pose.hpp"

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
  [[nodiscard]] filter::Vector<float, 2> predict(const PlanarPose& pose) const {
    const auto lever_n = lever(pose);
    return {pose.x.minus(x) + lever_n(0), pose.y.minus(y) + lever_n(1)};
  }
  [[nodiscard]] filter::Vector<float, 2> residual(const filter::Vector<float, 2>& z_hat) const { return -z_hat; }
  [[nodiscard]] filter::Vector<float, 2> noise() const { return {sigma_m * sigma_m, sigma_m * sigma_m}; }
  [[nodiscard]] filter::Matrix<float, 2, 3> jacobian(const PlanarPose& pose) const {
    const auto lever_n = lever(pose);
    filter::Matrix<float, 2, 3> h;
    h << 1.0F, 0.0F, -lever_n(1), 0.0F, 1.0F, lever_n(0);
    return h;
  }

 private:
  [[nodiscard]] filter::Vector<float, 2> lever(const PlanarPose& pose) const {
    const base::SinCos heading = base::sincos(pose.yaw_rad);
    return {heading.cos * antenna_x_b_m - heading.sin * antenna_y_b_m,
            heading.sin * antenna_x_b_m + heading.cos * antenna_y_b_m};
  }
};

}  // namespace tetap::model
