// SPDX-License-Identifier: Apache-2.0
// The robots of config/mrclam.hpp with 1000 particles in the place of the extended Kalman filter.
//
// How the sensor's noise was found: test/replay/particle_noise.py, on the five robots together, one left out in turn.
// The tempered likelihood widens both sigmas, so a range as wide as the EKF's would make wrong places look right.
#pragma once

#include "config/mrclam.hpp"
#include "estimators/planar/pose_particles.hpp"

namespace tetap::robot::mrclam_pf {

using Estimators = node::Estimators<estimators::Odometry, estimators::PoseParticles<1000>>;

inline constexpr param::Parameters parameters = param::checked([] {
  param::Parameters n = mrclam::parameters;
  n.landmark.sigma_range_m = 0.05F;
  n.landmark.sigma_range_per_m = 0.025F;
  n.landmark.sigma_bearing_rad = 0.04F;
  return n;
}());

}  // namespace tetap::robot::mrclam_pf
