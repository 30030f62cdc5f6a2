// SPDX-License-Identifier: Apache-2.0
// Parameters of the robot tracker (config/tracker.hpp).
#pragma once

#include "tetap/param/limits.hpp"

namespace tetap::robot::tracker {

inline constexpr param::Parameters parameters = param::checked({
    .target = {.acceleration_mps2 = 3, .gate_scale = 3},
    .recovery = {.after_us = 0, .at_least = 5},
});

}  // namespace tetap::robot::tracker
