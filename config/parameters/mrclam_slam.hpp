// SPDX-License-Identifier: Apache-2.0
// Parameters of the robot mrclam_slam (config/mrclam_slam.hpp).
#pragma once

#include "config/parameters/mrclam.hpp"
#include "tetap/param/limits.hpp"

namespace tetap::robot::mrclam_slam {

inline constexpr param::Parameters parameters = param::checked([] {
  param::Parameters n = mrclam::parameters;
  n.wheels.speed_scale = 0.95F;
  n.wheels.yaw_rate_scale = 0.975F;
  n.wheels.noise = {
      .speed = 0.001F, .yaw_rate = 0.0008F, .yaw_rate_per_yaw_rate = 0.01F, .yaw_rate_per_speed = 0.0005F};
  n.landmark.sigma_range_m = 0.05F;
  n.landmark.sigma_range_per_m = 0.06F;
  // The scale of the ranges is that of the map.
  n.landmark.range_scale = 0.97F;
  n.mapping = {.correlation_m = 0.1F};
  return n;
}());

}  // namespace tetap::robot::mrclam_slam
