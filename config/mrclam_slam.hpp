// SPDX-License-Identifier: Apache-2.0
// The robots of config/mrclam.hpp without a map: EKF-SLAM makes one of up to thirty landmarks. The numbers are those
// of docs/explanation/ekf_slam.md, found on the five robots of Dataset 7 together, leaving one out in turn.
#pragma once

#include "config/mrclam.hpp"
#include "estimators/mapping/planar_mapper.hpp"

namespace tetap::robot::mrclam_slam {

using Estimators = node::Estimators<estimators::Odometry, estimators::EkfSlam30>;

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
