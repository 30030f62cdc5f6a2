// SPDX-License-Identifier: Apache-2.0
// Walls of a course: upright rectangles, straight in plan, in the frame of the course.
#pragma once

#include <cstdint>
#include <vector>

namespace tetap::sim {

enum class Surface : std::uint8_t { kPlain, kGlass };

struct Wall {
  double from_x_m = 0, from_y_m = 0, to_x_m = 0, to_y_m = 0;
  double low_m = 0, high_m = 2.5;
  Surface surface = Surface::kPlain;
};

/// A box with sides along the axes, from one corner to the opposite one.
inline void add_box(std::vector<Wall>& walls, double x_m, double y_m, double to_x_m, double to_y_m,
                    double high_m = 2.5) {
  walls.push_back({.from_x_m = x_m, .from_y_m = y_m, .to_x_m = to_x_m, .to_y_m = y_m, .high_m = high_m});
  walls.push_back({.from_x_m = to_x_m, .from_y_m = y_m, .to_x_m = to_x_m, .to_y_m = to_y_m, .high_m = high_m});
  walls.push_back({.from_x_m = to_x_m, .from_y_m = to_y_m, .to_x_m = x_m, .to_y_m = to_y_m, .high_m = high_m});
  walls.push_back({.from_x_m = x_m, .from_y_m = to_y_m, .to_x_m = x_m, .to_y_m = y_m, .high_m = high_m});
}

}  // namespace tetap::sim
