// SPDX-License-Identifier: Apache-2.0
// A rover that maps landmarks without identities: wheels, a gyroscope and a camera, EKF-SLAM of thirty landmarks. The
// simulated world has landmarks on both sides of its way, clutter and moving obstacles for it.
#pragma once

#include "config/rover_landmarks.hpp"
#include "estimators/mapping/planar_mapper.hpp"

namespace tetap::robot::mapper {

using Estimators = node::Estimators<estimators::Odometry, estimators::EkfSlam30>;

inline constexpr param::Parameters parameters = param::checked([] {
  param::Parameters n = rover_landmarks::parameters;
  n.gnss = {};
  n.wired = {.imu = 1, .encoders = 1};
  n.landmark.gate_scale = 1.5F;
  // Sightings of one stamp have to fit together, which is what clutter and two near landmarks seldom do.
  n.mapping = {.association = 2};
  return n;
}());

}  // namespace tetap::robot::mapper
