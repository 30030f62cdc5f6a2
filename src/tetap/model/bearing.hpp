// SPDX-License-Identifier: Apache-2.0
// Bearing to a known landmark: cameras, beacons seen by angle only.
#pragma once

#include "tetap/model/landmark.hpp"

#include <array>

namespace tetap::model {

struct Bearing {
  static constexpr int kDimension = 1;
  static constexpr std::array<int, 3> kTouches{0, 1, 2};
  static constexpr std::array<int, 1> kAngles{0};

  float bearing_rad = 0;
  float sigma_bearing_rad = 0;
  Landmark landmark;
  PlanarMounting mounting;

  [[nodiscard]] filter::Vector<float, 1> predict(const PlanarPose& pose) const { return linearised(pose).z_hat; }
  [[nodiscard]] filter::Vector<float, 1> residual(const filter::Vector<float, 1>& z_hat) const {
    return filter::Vector<float, 1>(base::wrap_angle(bearing_rad - z_hat(0)));
  }
  [[nodiscard]] filter::Vector<float, 1> noise() const {
    return filter::Vector<float, 1>(sigma_bearing_rad * sigma_bearing_rad);
  }
  [[nodiscard]] filter::Matrix<float, 1, 3> jacobian(const PlanarPose& pose) const { return linearised(pose).h; }
  [[nodiscard]] filter::Linearised<float, 1, 3> linearised(const PlanarPose& pose) const {
    const Sight sight(pose, landmark, mounting);
    return {.z_hat = filter::Vector<float, 1>(sight.bearing_rad(pose, mounting)), .h = sight.bearing_row()};
  }
};

}  // namespace tetap::model
