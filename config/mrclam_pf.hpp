// SPDX-License-Identifier: Apache-2.0
// The robots of config/mrclam.hpp with 1000 particles in the place of the extended Kalman filter.
//
// How the sensor's noise was found: test/replay/particle_noise.py, on the five robots together, one left out in turn.
// The tempered likelihood widens both sigmas, so a range as wide as the EKF's would make wrong places look right.
#pragma once

#include "config/parameters/mrclam_pf.hpp"
#include "tetap/estimators/odometry.hpp"
#include "tetap/estimators/planar/pose_particles.hpp"
#include "tetap/node/node.hpp"

namespace tetap::robot::mrclam_pf {

using Estimators = node::Estimators<estimators::Odometry, estimators::PoseParticles<1000>>;

}  // namespace tetap::robot::mrclam_pf
