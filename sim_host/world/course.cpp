// SPDX-License-Identifier: Apache-2.0
#include "sim_host/world/course.hpp"

#include "sim_host/world/math.hpp"

#include <algorithm>
#include <cstdlib>
#include <string>

namespace tetap::sim {

Course default_course() {
  return {
      .waypoints =
          {
              {.x_m = 0, .y_m = 0, .stop_s = 10},  // heading east
              {.x_m = 48, .y_m = 0, .radius_m = 4},
              // skid pad to the left, two rounds
              {.x_m = 48, .y_m = 16, .radius_m = 4},
              {.x_m = 40, .y_m = 16, .radius_m = 4},
              {.x_m = 40, .y_m = 8, .radius_m = 4},
              {.x_m = 48, .y_m = 8, .radius_m = 4},
              {.x_m = 48, .y_m = 16, .radius_m = 4},
              {.x_m = 40, .y_m = 16, .radius_m = 4},
              {.x_m = 40, .y_m = 8, .radius_m = 4},
              {.x_m = 48, .y_m = 8, .radius_m = 4},
              {.x_m = 48, .y_m = 28, .radius_m = 3},
              // slalom, westward
              {.x_m = 43, .y_m = 28, .radius_m = 6},
              {.x_m = 38, .y_m = 29.5, .radius_m = 4},
              {.x_m = 33, .y_m = 26.5, .radius_m = 4},
              {.x_m = 28, .y_m = 29.5, .radius_m = 4},
              {.x_m = 23, .y_m = 26.5, .radius_m = 4},
              {.x_m = 19, .y_m = 28, .radius_m = 4},
              {.x_m = 14, .y_m = 28, .stop_s = 12},
              // hairpin
              {.x_m = 6, .y_m = 28, .radius_m = 3},
              {.x_m = 6, .y_m = 16, .radius_m = 0.6},
              {.x_m = 7.2, .y_m = 16, .radius_m = 0.6},
              {.x_m = 7.2, .y_m = 23, .radius_m = 1.5},
              {.x_m = 16, .y_m = 23, .radius_m = 2},
              // skid pad to the right, one round
              {.x_m = 16, .y_m = 11, .radius_m = 3},
              {.x_m = 10, .y_m = 11, .radius_m = 3},
              {.x_m = 10, .y_m = 17, .radius_m = 3},
              {.x_m = 16, .y_m = 17, .radius_m = 3},
              {.x_m = 16, .y_m = 7, .radius_m = 2},
              // corners of a yard, and home
              {.x_m = 32, .y_m = 7, .radius_m = 2},
              {.x_m = 32, .y_m = 19, .radius_m = 1},
              {.x_m = 22, .y_m = 19, .radius_m = 1},
              {.x_m = 22, .y_m = 4, .radius_m = 2},
              {.x_m = -4, .y_m = 4, .radius_m = 2},
              {.x_m = -4, .y_m = 0, .radius_m = 2},
              {.x_m = 0.5, .y_m = 0, .stop_s = 8},
          },
      .landmarks =
          {
              {1, 9, -2.5},  {2, 22, -2.5}, {3, 36, -2.5},  {4, 51, -2},  {5, 52, 9},  {6, 44, 12},   {7, 52, 20},
              {8, 49.5, 31}, {9, 36, 32},   {10, 25.5, 24}, {11, 21, 31}, {12, 9, 31}, {13, 2.5, 27}, {14, 3, 14},
              {15, 13, 14},  {16, 20, 12},  {17, 27, 13},   {18, 35, 12}, {19, 8, 7},  {20, -7, 2},
          },
  };
}

Course default_course(int laps) {
  Course course = default_course();
  const std::vector<Waypoint> lap(course.waypoints.begin() + 1, course.waypoints.end());
  for (int k = 1; k < laps; ++k) course.waypoints.insert(course.waypoints.end(), lap.begin(), lap.end());
  return course;
}

Course road_course(int laps) {
  Course course{.waypoints = {{.x_m = 0, .y_m = 0, .stop_s = 10}}, .landmarks = {{1, 100, -5}, {2, 205, 100}}};
  for (int k = 0; k < laps; ++k)
    for (const Waypoint& at : {Waypoint{.x_m = 200, .y_m = 0, .radius_m = 40},
                               {.x_m = 200, .y_m = 200, .radius_m = 40},
                               {.x_m = 100, .y_m = 200, .radius_m = 40},
                               {.x_m = 100, .y_m = 100, .radius_m = 40},
                               {.x_m = 0, .y_m = 100, .radius_m = 40},
                               {.x_m = 0, .y_m = 220, .radius_m = 40},
                               {.x_m = -100, .y_m = 220, .radius_m = 40},
                               {.x_m = -100, .y_m = 0, .radius_m = 40},
                               {.x_m = -10, .y_m = 0, .stop_s = k + 1 == laps ? 8.0 : 5.0}})
      course.waypoints.push_back(at);
  return course;
}

Course street_course(int laps) {
  Course course{.waypoints = {{.x_m = 0, .y_m = 0, .stop_s = 10}}, .landmarks = {}};
  for (int k = 0; k < laps; ++k)
    for (const Waypoint& at : {Waypoint{.x_m = 150, .y_m = 0, .radius_m = 12},
                               {.x_m = 150, .y_m = 80, .radius_m = 12},
                               {.x_m = 60, .y_m = 80, .radius_m = 12},
                               {.x_m = 60, .y_m = 160, .radius_m = 12},
                               {.x_m = 160, .y_m = 160, .radius_m = 15},
                               {.x_m = 160, .y_m = 240, .radius_m = 10},
                               {.x_m = 80, .y_m = 240, .stop_s = 10},
                               {.x_m = -40, .y_m = 240, .radius_m = 15},
                               {.x_m = -40, .y_m = 150, .radius_m = 15},
                               {.x_m = -20, .y_m = 110, .radius_m = 15},
                               {.x_m = -40, .y_m = 70, .radius_m = 15},
                               {.x_m = -40, .y_m = 0, .radius_m = 12},
                               {.x_m = -10, .y_m = 0, .stop_s = 8}})
      course.waypoints.push_back(at);
  return course;
}

Course flight_course(int laps) {
  Course course{.waypoints = {{.x_m = 0, .y_m = 0, .stop_s = 24}}, .landmarks = {}};
  for (int k = 0; k < laps; ++k)
    for (const Waypoint& at : {Waypoint{.x_m = 60, .y_m = 0, .radius_m = 5},
                               {.x_m = 60, .y_m = 40, .radius_m = 8},
                               {.x_m = 20, .y_m = 40, .radius_m = 5},
                               {.x_m = 20, .y_m = 90, .radius_m = 5},
                               {.x_m = 70, .y_m = 90, .radius_m = 5},
                               {.x_m = 70, .y_m = 130, .radius_m = 5},
                               {.x_m = 30, .y_m = 130, .stop_s = 8},
                               {.x_m = -30, .y_m = 130, .radius_m = 10},
                               {.x_m = -30, .y_m = 70, .radius_m = 5},
                               {.x_m = -60, .y_m = 70, .radius_m = 5},
                               {.x_m = -60, .y_m = 0, .radius_m = 8},
                               {.x_m = -8, .y_m = 0, .stop_s = k + 1 == laps ? 24.0 : 5.0}})
      course.waypoints.push_back(at);
  return course;
}

Course loop_course(double length_m, int laps, int landmarks) {
  constexpr double kBeside_m = 2;
  if (!(length_m >= 20) || landmarks < 4 || landmarks > 254) return {.waypoints = {}, .landmarks = {}};
  const double radius_m = length_m / 20;
  const double side_m = (length_m - (2 * kPi - 8) * radius_m) / 4;
  Course course{.waypoints = {{.x_m = 0, .y_m = 0, .stop_s = 5}}, .landmarks = {}};
  for (int k = 0; k < laps; ++k)
    for (const auto& [x, y] :
         {std::pair{side_m / 2, 0.0}, {side_m / 2, side_m}, {-side_m / 2, side_m}, {-side_m / 2, 0.0}})
      course.waypoints.push_back({.x_m = x, .y_m = y, .radius_m = radius_m});
  course.waypoints.push_back({.x_m = 0, .y_m = 0, .stop_s = 5});
  const Plan plan(course, {});
  for (int i = 0; i < landmarks; ++i) {
    const PathPoint at = plan.path((i + 0.5) * length_m / landmarks);
    const Direction ahead = direction(at.yaw_rad);
    const double left_m = i % 2 == 0 ? -kBeside_m : kBeside_m;
    course.landmarks.push_back({.id = static_cast<std::uint8_t>(i + 1),
                                .x_m = at.x_m - left_m * ahead.sin,
                                .y_m = at.y_m + left_m * ahead.cos});
  }
  return course;
}

Course circle_course(double radius_m, int turns) {
  const double r = radius_m;
  Course course{.waypoints = {{.x_m = -5, .y_m = 0, .stop_s = 2}}, .landmarks = {{1, 0, r}}};
  for (int k = 0; k < turns; ++k)
    for (const auto& [x, y] : {std::pair{r, 0.0}, {r, 2 * r}, {-r, 2 * r}, {-r, 0.0}})
      course.waypoints.push_back({.x_m = x, .y_m = y, .radius_m = r});
  course.waypoints.push_back({.x_m = 5, .y_m = 0, .stop_s = 2});
  return course;
}

Plan::Plan(const Course& course, const CourseLimits& limits) {
  if (!add_pieces(course).empty()) std::abort();
  add_speeds(limits);
}

std::string Plan::refusal(const Course& course) { return Plan().add_pieces(course); }

std::string Plan::add_pieces(const Course& course) {
  const auto& way = course.waypoints;
  if (way.size() < 2) return "a course needs two waypoints";
  const auto refused = [](std::size_t index, const std::string& why) {
    return "course, waypoint " + std::to_string(index) + ": " + why;
  };
  double yaw_rad = sim::atan2(way[1].y_m - way[0].y_m, way[1].x_m - way[0].x_m);
  double x_m = way[0].x_m;
  double y_m = way[0].y_m;
  const auto add = [&](double length_m, double curvature) {
    if (length_m <= 0) return;
    pieces_.push_back({length_m_, length_m, curvature, x_m, y_m, yaw_rad});
    length_m_ += length_m;
    const PathPoint end = path(length_m_);
    x_m = end.x_m, y_m = end.y_m, yaw_rad = end.yaw_rad;
  };

  for (std::size_t i = 0; i < way.size(); ++i) {
    if (way[i].stop_s > 0 && way[i].radius_m > 0) return refused(i, "a standstill within a corner");
    if (i > 0) {
      const double dx = way[i].x_m - x_m;
      const double dy = way[i].y_m - y_m;
      const double straight_m = sim::sqrt(dx * dx + dy * dy);
      double turn_rad = 0;
      if (i + 1 < way.size())
        turn_rad = wrap(sim::atan2(way[i + 1].y_m - way[i].y_m, way[i + 1].x_m - way[i].x_m) - yaw_rad);
      const double half_tangent = sim::sin(magnitude(turn_rad) / 2) / sim::cos(magnitude(turn_rad) / 2);
      const double tangent_m = way[i].radius_m * half_tangent;
      if (way[i].radius_m <= 0 && magnitude(turn_rad) > 1e-6) return refused(i, "a corner without a radius");
      // A tangent may use all that is left of a leg; rounding must not make it one bit too long.
      if (tangent_m > straight_m + 1e-9) return refused(i, "its arc does not fit");
      add(straight_m - tangent_m, 0);
      if (tangent_m > 0) add(way[i].radius_m * magnitude(turn_rad), (turn_rad > 0 ? 1 : -1) / way[i].radius_m);
    }
    if (way[i].stop_s > 0) stops_m_.push_back(length_m_), stops_s_.push_back(way[i].stop_s);
  }
  return "";
}

void Plan::add_speeds(const CourseLimits& limits) {
  // Path lengths at which the plan has nodes: a fine grid, and every stop exactly.
  constexpr double kGrid_m = 0.02;
  std::vector<double> at_m = stops_m_;
  for (double s = 0; s < length_m_; s += kGrid_m) at_m.push_back(s);
  at_m.push_back(length_m_);
  std::sort(at_m.begin(), at_m.end());
  at_m.erase(std::unique(at_m.begin(), at_m.end(), [](double a, double b) { return b - a < 1e-9; }), at_m.end());

  const auto stop_at = [&](double s) {
    for (std::size_t k = 0; k < stops_m_.size(); ++k)
      if (magnitude(stops_m_[k] - s) < 1e-9) return stops_s_[k];
    return 0.0;
  };
  std::vector<double> speed(at_m.size());
  for (std::size_t i = 0; i < at_m.size(); ++i) {
    const double bend = magnitude(path(at_m[i]).curvature_per_m);
    speed[i] = limits.speed_mps;
    if (bend > 0) speed[i] = std::min({speed[i], sim::sqrt(limits.lateral_mps2 / bend), limits.yaw_rate_radps / bend});
    if (i == 0 || i + 1 == at_m.size() || stop_at(at_m[i]) > 0) speed[i] = 0;
  }
  // Braking is planned from the end, accelerating from the start: v^2 grows by 2 a ds.
  const auto reachable = [&](std::size_t from, std::size_t to) {
    const double ds = magnitude(at_m[to] - at_m[from]);
    return std::min(speed[to], sim::sqrt(speed[from] * speed[from] + 2 * limits.acceleration_mps2 * ds));
  };
  for (std::size_t i = at_m.size() - 1; i > 0; --i) speed[i - 1] = reachable(i, i - 1);
  for (std::size_t i = 1; i < at_m.size(); ++i) speed[i] = reachable(i - 1, i);

  double time_s = 0;
  for (std::size_t i = 0; i < at_m.size(); ++i) {
    if (i > 0) time_s += 2 * (at_m[i] - at_m[i - 1]) / (speed[i] + speed[i - 1]);
    nodes_.push_back({at_m[i], speed[i], time_s});
    arrival_s_ = time_s;
    if (const double wait_s = stop_at(at_m[i]); wait_s > 0) nodes_.push_back({at_m[i], 0, time_s += wait_s});
  }
  duration_ = {static_cast<std::int64_t>(sim::floor(time_s * 100)) * 10'000 + 10'000};
}

const Plan::Piece& Plan::piece(double s_m) const {
  const auto after =
      std::upper_bound(pieces_.begin(), pieces_.end(), s_m, [](double s, const Piece& p) { return s < p.s_m; });
  return after == pieces_.begin() ? pieces_.front() : *(after - 1);
}

PathPoint Plan::path(double s_m) const {
  const Piece& p = piece(s_m);
  const double along = s_m - p.s_m;
  const Direction from = direction(p.yaw_rad);
  const double yaw_rad = p.yaw_rad + p.curvature_per_m * along;
  const double curvature = s_m < length_m_ ? p.curvature_per_m : 0;
  if (magnitude(p.curvature_per_m) < 1e-12) return {p.x_m + along * from.cos, p.y_m + along * from.sin, yaw_rad, 0};
  const Direction to = direction(yaw_rad);
  return {p.x_m + (to.sin - from.sin) / p.curvature_per_m, p.y_m - (to.cos - from.cos) / p.curvature_per_m, yaw_rad,
          curvature};
}

PlanPoint Plan::at(base::Micros since_start) const {
  const double time_s = static_cast<double>(since_start.us) * 1e-6;
  const auto after =
      std::upper_bound(nodes_.begin(), nodes_.end(), time_s, [](double t, const Node& n) { return t < n.time_s; });
  if (after == nodes_.begin()) return {.s_m = 0, .parked = true};
  if (after == nodes_.end()) return {.s_m = length_m_, .parked = true};
  const Node& a = *(after - 1);
  const Node& b = *after;
  const double dt = b.time_s - a.time_s;
  if (b.s_m - a.s_m < 1e-12) return {.s_m = a.s_m, .parked = true};
  const double acceleration = (b.speed_mps - a.speed_mps) / dt;
  const double t = time_s - a.time_s;
  return {.s_m = a.s_m + (a.speed_mps + 0.5 * acceleration * t) * t,
          .speed_mps = a.speed_mps + acceleration * t,
          .acceleration_mps2 = acceleration};
}

base::Micros Plan::time_at(double s_m) const {
  const auto after =
      std::lower_bound(nodes_.begin(), nodes_.end(), s_m, [](const Node& n, double s) { return n.s_m < s; });
  if (after == nodes_.end()) return duration_;
  return {static_cast<std::int64_t>(sim::floor(after->time_s * 1e6))};
}

}  // namespace tetap::sim
