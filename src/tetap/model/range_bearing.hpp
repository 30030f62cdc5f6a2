// SPDX-License-Identifier: Apache-2.0
// Range and bearing to a known landmark (Thrun, Burgard, Fox 2005, eq. 7.11-7.14, with a lever arm).
#pragma once

#include "tetap/model/landmark.hpp"

#include <array>

namespace tetap::model {

struct RangeBearing {
  static constexpr int kDimension = 2;
  static constexpr std::array<int, 3> kTouches{0, 1, 2};
  static constexpr std::array<int, 1> kAngles{1};

  float range_m = 0;
  float bearing_rad = 0;
  float sigma_range_m = 0;
  float sigma_bearing_rad = 0;
  Landmark landmark;
  PlanarMounting mounting;

  [[nodiscard]] filter::Vector<float, 2> predict(const PlanarPose& pose) const { return linearised(pose).z_hat; }
  [[nodiscard]] filter::Vector<float, 2> residual(const filter::Vector<float, 2>& z_hat) const {
    return {range_m - z_hat(0), base::wrap_angle(bearing_rad - z_hat(1))};
  }
  [[nodiscard]] filter::Vector<float, 2> noise() const {
    return {sigma_range_m * sigma_range_m, sigma_bearing_rad * sigma_bearing_rad};
  }
  [[nodiscard]] filter::Matrix<float, 2, 3> jacobian(const PlanarPose& pose) const { return linearised(pose).h; }
  [[nodiscard]] filter::Linearised<float, 2, 3> linearised(const PlanarPose& pose) const {
    const Sight sight(pose, landmark, mounting);
    filter::Linearised<float, 2, 3> at;
    const float inverse = sight.inverse_range();
    at.z_hat = {sight.range2_m2 * inverse, sight.bearing_rad(pose, mounting)};
    at.h.row(0) = sight.range_row(inverse);
    at.h.row(1) = sight.bearing_row(inverse);
    return at;
  }
};

}  // namespace tetap::model
