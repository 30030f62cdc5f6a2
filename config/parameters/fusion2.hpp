// SPDX-License-Identifier: Apache-2.0
// Parameters of the robot fusion2 (config/fusion2.hpp).
#pragma once

#include "tetap/param/limits.hpp"

namespace tetap::robot::fusion2 {

inline constexpr param::Parameters parameters = param::checked({
    // Two receivers of the same make state 1 sigma per axis; the origin is the first fix.
    .gnss = {.sigma_floor_m = 0.05F, .sigma_scale = 1.0F},
});

}  // namespace tetap::robot::fusion2
