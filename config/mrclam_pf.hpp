// SPDX-License-Identifier: Apache-2.0
// The robots of config/mrclam.hpp, with the same numbers, and 1000 particles in the place of the extended Kalman
// filter.
#pragma once

#include "config/mrclam.hpp"
#include "estimators/planar/pose_particles.hpp"

namespace tetap::robot::mrclam_pf {

using Estimators = node::Estimators<estimators::Odometry, estimators::PoseParticles<1000>>;

inline constexpr param::Parameters parameters = mrclam::parameters;

}  // namespace tetap::robot::mrclam_pf
