// SPDX-License-Identifier: Apache-2.0
// Courses inside a building, with its walls.
#pragma once

#include "sim_host/world/course.hpp"

namespace tetap::sim {

/// A laboratory of 36 m x 24 m: a corridor around a core, a hall at each end, rooms with furniture, panes of glass, no
/// symmetry. Odd laps of 70 m lead through both halls, even ones of 40 m round the corridor.
[[nodiscard]] Course lab_course(int laps);
/// A straight corridor of 60 m x 2.4 m without doors, driven once, from 15 m to 45 m.
[[nodiscard]] Course corridor_course();

}  // namespace tetap::sim
