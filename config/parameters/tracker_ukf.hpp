// SPDX-License-Identifier: Apache-2.0
// Parameters of the robot tracker_ukf (config/tracker_ukf.hpp).
#pragma once

#include "tetap/param/limits.hpp"

namespace tetap::robot::tracker_ukf {

inline constexpr param::Parameters parameters = param::checked({
    .target = {.acceleration_mps2 = 1.5F,
               .yaw_acceleration_radps2 = 0.6F,
               .sigma_speed_mps = 5,
               .sigma_yaw_rad = 0.1F,
               .gate_scale = 3},
    .recovery = {.after_us = 0, .at_least = 5},
});

}  // namespace tetap::robot::tracker_ukf
