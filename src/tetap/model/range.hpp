// SPDX-License-Identifier: Apache-2.0
// Range to a known landmark: ultra-wideband anchors, acoustic beacons.
#pragma once

#include "tetap/model/landmark.hpp"

#include <array>

namespace tetap::model {

struct Range {
  static constexpr int kDimension = 1;
  static constexpr std::array<int, 3> kTouches{0, 1, 2};

  float range_m = 0;
  float sigma_range_m = 0;
  Landmark landmark;
  PlanarMounting mounting;

  [[nodiscard]] filter::Vector<float, 1> predict(const PlanarPose& pose) const { return linearised(pose).z_hat; }
  [[nodiscard]] filter::Vector<float, 1> residual(const filter::Vector<float, 1>& z_hat) const {
    return filter::Vector<float, 1>(range_m - z_hat(0));
  }
  [[nodiscard]] filter::Vector<float, 1> noise() const {
    return filter::Vector<float, 1>(sigma_range_m * sigma_range_m);
  }
  [[nodiscard]] filter::Matrix<float, 1, 3> jacobian(const PlanarPose& pose) const { return linearised(pose).h; }
  [[nodiscard]] filter::Linearised<float, 1, 3> linearised(const PlanarPose& pose) const {
    const Sight sight(pose, landmark, mounting);
    return {.z_hat = filter::Vector<float, 1>(sight.range_m()), .h = sight.range_row()};
  }
};

}  // namespace tetap::model
