// SPDX-License-Identifier: Apache-2.0
// Parameters of the robot mrclam_fast (config/mrclam_fast.hpp).
#pragma once

#include "config/parameters/mrclam_slam.hpp"
#include "tetap/param/limits.hpp"

namespace tetap::robot::mrclam_fast {

inline constexpr param::Parameters parameters = param::checked([] {
  param::Parameters n = mrclam_slam::parameters;
  n.wheels.noise.yaw_rate = 0.0005F;
  n.landmark.sigma_range_m = 0.07F;
  n.landmark.sigma_range_per_m = 0.05F;
  n.mapping = {.correlation_m = 0.015F, .resample_share = 0.5F};
  return n;
}());

}  // namespace tetap::robot::mrclam_fast
