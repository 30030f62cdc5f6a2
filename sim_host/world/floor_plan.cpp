// SPDX-License-Identifier: Apache-2.0
#include "sim_host/world/floor_plan.hpp"

#include <initializer_list>
#include <utility>

namespace tetap::sim {
namespace {

using Gaps = std::initializer_list<std::pair<double, double>>;

/// Along x at y, with doors left out; the gaps are in order.
void add_along_x(std::vector<Wall>& walls, double y_m, double from_m, double to_m, Gaps gaps = {}) {
  for (const auto& [begin_m, end_m] : gaps) {
    walls.push_back({.from_x_m = from_m, .from_y_m = y_m, .to_x_m = begin_m, .to_y_m = y_m});
    from_m = end_m;
  }
  walls.push_back({.from_x_m = from_m, .from_y_m = y_m, .to_x_m = to_m, .to_y_m = y_m});
}

void add_along_y(std::vector<Wall>& walls, double x_m, double from_m, double to_m, Gaps gaps = {}) {
  for (const auto& [begin_m, end_m] : gaps) {
    walls.push_back({.from_x_m = x_m, .from_y_m = from_m, .to_x_m = x_m, .to_y_m = begin_m});
    from_m = end_m;
  }
  walls.push_back({.from_x_m = x_m, .from_y_m = from_m, .to_x_m = x_m, .to_y_m = to_m});
}

std::vector<Wall> lab_walls() {
  std::vector<Wall> walls;
  add_box(walls, 0, 0, 36, 24);
  add_box(walls, 13, 9, 23, 15);  // the core
  // Both sides of the corridor, with the doors of the rooms in the south and in the north.
  add_along_x(walls, 6.5, 0, 36, {{13.5, 14.6}, {19, 20}, {30, 31.2}});
  add_along_x(walls, 17.5, 0, 36, {{4, 5}, {16, 17.4}, {27.5, 28.5}});
  // The halls at the ends have two doors each, through which the course leads.
  add_along_y(walls, 10.5, 6.5, 17.5, {{7, 8.5}, {15.5, 17}});
  add_along_y(walls, 25.5, 6.5, 17.5, {{7, 8.5}, {15.5, 17}});
  for (const double x_m : {9.0, 17.5, 26.0}) add_along_y(walls, x_m, 0, 6.5);
  for (const double x_m : {7.5, 21.0}) add_along_y(walls, x_m, 17.5, 24);
  // Furniture: cupboards, tables as boxes, a desk.
  add_box(walls, 0.6, 10, 1.6, 13.5, 1.9);
  add_box(walls, 5.5, 10.2, 7.3, 12.4, 0.75);
  add_box(walls, 28.4, 13, 30.8, 14.2, 0.75);
  add_box(walls, 34.8, 8, 35.6, 10.5, 1.9);
  add_box(walls, 33.4, 11.4, 34, 12);  // a pillar
  add_box(walls, 14, 17, 15.2, 17.45, 1.9);
  add_box(walls, 20.4, 8.55, 21.6, 8.95, 1.2);
  add_box(walls, 11, 1, 13, 2.2, 0.75);
  add_box(walls, 22, 3, 23.5, 5, 0.75);
  add_box(walls, 10, 21, 12.5, 22, 0.75);
  // Panes in front of the hall in the east and of the corridor's core.
  walls.push_back({.from_x_m = 35.5, .from_y_m = 12, .to_x_m = 35.5, .to_y_m = 16.5, .surface = Surface::kGlass});
  walls.push_back({.from_x_m = 14, .from_y_m = 15.15, .to_x_m = 18, .to_y_m = 15.15, .surface = Surface::kGlass});
  return walls;
}

}  // namespace

Course lab_course(int laps) {
  Course course{.waypoints = {{.x_m = 16, .y_m = 7.75, .stop_s = 5}}, .landmarks = {}, .walls = lab_walls()};
  const auto round = [&course](double west_m, double east_m) {
    for (const auto& [x_m, y_m] : {std::pair{east_m, 7.75}, {east_m, 16.25}, {west_m, 16.25}, {west_m, 7.75}})
      course.waypoints.push_back({.x_m = x_m, .y_m = y_m, .radius_m = 0.8});
  };
  for (int lap = 0; lap < laps; ++lap) lap % 2 == 0 ? round(3.5, 32) : round(11.75, 24.25);
  course.waypoints.push_back({.x_m = 16, .y_m = 7.75, .stop_s = 5});
  return course;
}

Course corridor_course() {
  Course course{.waypoints = {{.x_m = 15, .y_m = 0, .stop_s = 5}, {.x_m = 45, .y_m = 0, .stop_s = 5}}, .landmarks = {}};
  add_box(course.walls, 0, -1.2, 60, 1.2);
  return course;
}

}  // namespace tetap::sim
