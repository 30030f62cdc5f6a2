// SPDX-License-Identifier: Apache-2.0
// Parameters of the robot labyrinth (config/labyrinth.hpp).
#pragma once

#include "tetap/param/limits.hpp"

namespace tetap::robot::labyrinth {

inline constexpr param::Parameters parameters = param::checked({
    // The set states half the track, 0.0785 m (its odometry only meets the truth so), wheel speed variance 1e-4 (m/s)^2
    // at 7.8 Hz (times 0.128 s: a density), range variance 0.01 m^2.
    .wheels = {.drive = {.left_radius_m = 0.05F, .right_radius_m = 0.05F, .track_m = 0.157F},
               .wheel_speed_noise = 1.3e-5F},
    // Ranges come out 0.1 m long and scatter by as much: the innovations ask for twice the stated sigma.
    .landmark = {.sigma_range_only_m = 0.2F},
});

}  // namespace tetap::robot::labyrinth
