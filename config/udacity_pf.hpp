// SPDX-License-Identifier: Apache-2.0
// The kidnapped vehicle of Udacity's particle filter project: a car in a simulated world, its speed and yaw rate ten
// times a second, landmarks on a map without identities, and a first fix. A hundred particles.
#pragma once

#include "config/parameters/udacity_pf.hpp"
#include "tetap/estimators/odometry.hpp"
#include "tetap/estimators/planar/pose_particles.hpp"
#include "tetap/node/node.hpp"

namespace tetap::robot::udacity_pf {

using Estimators = node::Estimators<estimators::Odometry, estimators::PoseParticles<100>>;

}  // namespace tetap::robot::udacity_pf
