// SPDX-License-Identifier: Apache-2.0
// Parameters of the robot udacity_pf (config/udacity_pf.hpp).
#pragma once

#include "tetap/param/limits.hpp"

namespace tetap::robot::udacity_pf {

inline constexpr param::Parameters parameters = param::checked({
    .loop = {.window_us = 20'000},  // samples come in order
    .wheels = {.noise = {.speed = 0.002F, .yaw_rate = 2e-5F}, .hold = param::Hold::kForward},
    .landmark = {.sigma_range_m = 0.2F, .sigma_bearing_rad = 0.008F},
    .particles = {.temper = 1, .jitter = 0.025F},
});

}  // namespace tetap::robot::udacity_pf
