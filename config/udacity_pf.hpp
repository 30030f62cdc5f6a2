// SPDX-License-Identifier: Apache-2.0
// The kidnapped vehicle of Udacity's particle filter project: a car in a simulated world, its speed and yaw rate ten
// times a second, landmarks on a map without identities, and a first fix. A hundred particles.
#pragma once

#include "estimators/odometry.hpp"
#include "estimators/planar/pose_particles.hpp"
#include "node/node.hpp"
#include "param/limits.hpp"

namespace tetap::robot::udacity_pf {

using Estimators = node::Estimators<estimators::Odometry, estimators::PoseParticles<100>>;

inline constexpr param::Parameters parameters = param::checked({
    .loop = {.window_us = 20'000},  // samples come in order
    .wheels = {.noise = {.speed = 0.002F, .yaw_rate = 2e-5F}, .hold = param::Hold::kForward},
    .landmark = {.sigma_range_m = 0.2F, .sigma_bearing_rad = 0.008F},
    .particles = {.temper = 1, .jitter = 0.025F},
});

}  // namespace tetap::robot::udacity_pf
