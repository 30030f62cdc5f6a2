// SPDX-License-Identifier: Apache-2.0
// The robots of config/mrclam.hpp without a map: FastSLAM 2 with a hundred particles of up to fifteen landmarks. Motion
// and camera are those of config/mrclam_slam.hpp; the other numbers were chosen on the five robots together
// (docs/explanation/fast_slam.md).
#pragma once

#include "config/mrclam_slam.hpp"

namespace tetap::robot::mrclam_fast {

using Estimators = node::Estimators<estimators::Odometry, estimators::FastSlam100>;

inline constexpr param::Parameters parameters = param::checked([] {
  param::Parameters n = mrclam_slam::parameters;
  n.wheels.noise.yaw_rate = 0.0005F;
  n.landmark.sigma_range_m = 0.07F;
  n.landmark.sigma_range_per_m = 0.05F;
  n.mapping = {.correlation_m = 0.015F, .resample_share = 0.5F};
  return n;
}());

}  // namespace tetap::robot::mrclam_fast
