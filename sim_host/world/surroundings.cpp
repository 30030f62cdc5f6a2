// SPDX-License-Identifier: Apache-2.0
#include "sim_host/world/surroundings.hpp"

#include "sim_host/world/chance.hpp"

#include <algorithm>

namespace tetap::sim {
namespace {

constexpr double kFence_m = 6;       // from the outermost waypoint
constexpr double kPostHalf_m = 0.1;  // half the side of a landmark's post
constexpr double kOff_m = 0.01;      // of a point in front of its wall: it has one side
constexpr double kTexture_m = 0.5;   // of wall or way per point
constexpr double kBeside_m = 3;      // of points on the ground, to either side of the way
constexpr std::size_t kMostPoints = 3'000, kMostOnGround = 800;

/// Height of a landmark's post: 0.4 m to 1.3 m.
double post_m(const Landmark& mark) { return 0.4 + 0.3 * (mark.id % 4); }

/// By Cramer's rule: from + t along = a + s (b - a) in plan, with both numerators over one determinant.
std::optional<Hit> hit(const Ray& ray, const Wall& wall) {
  const double ex = wall.to_x_m - wall.from_x_m, ey = wall.to_y_m - wall.from_y_m;
  const double ax = wall.from_x_m - ray.from_m[0], ay = wall.from_y_m - ray.from_m[1];
  const double determinant = ray.along[0] * ey - ray.along[1] * ex;
  const double sign = determinant < 0 ? -1 : 1;
  const double share = sign * (ax * ray.along[1] - ay * ray.along[0]), range = sign * (ax * ey - ay * ex);
  if (share < 0 || share > sign * determinant || range <= 0) return std::nullopt;
  const double length_m = sim::sqrt(ex * ex + ey * ey);
  if (sign * determinant < 1e-12 * length_m) return std::nullopt;  // along the wall
  const double range_m = range / (sign * determinant);
  const double z_m = ray.from_m[2] + range_m * ray.along[2];
  if (z_m < wall.low_m || z_m > wall.high_m) return std::nullopt;
  return Hit{.range_m = range_m, .incidence_cos = sign * determinant / length_m, .surface = wall.surface};
}

/// An upright cylinder on the ground.
std::optional<Hit> hit(const Ray& ray, const Vector3& foot_m, double radius_m, double height_m) {
  const double dx = foot_m[0] - ray.from_m[0], dy = foot_m[1] - ray.from_m[1];
  const double flat = ray.along[0] * ray.along[0] + ray.along[1] * ray.along[1];
  const double ahead = dx * ray.along[0] + dy * ray.along[1];
  const double square = ahead * ahead - flat * (dx * dx + dy * dy - radius_m * radius_m);
  if (flat < 1e-12 || square < 0) return std::nullopt;
  const double range_m = (ahead - sim::sqrt(square)) / flat;
  const double z_m = ray.from_m[2] + range_m * ray.along[2];
  if (range_m <= 0 || z_m < 0 || z_m > height_m) return std::nullopt;
  return Hit{.range_m = range_m, .incidence_cos = sim::sqrt(square) / radius_m};
}

}  // namespace

Surroundings::Surroundings(const Course& course, const Plan& plan, const PeopleNumbers& people, std::uint64_t seed)
    : numbers_{people}, walls_{course.walls} {
  if (walls_.empty()) add_fence(course);
  add_points(course, plan);
  add_people(plan, seed);
}

void Surroundings::add_fence(const Course& course) {
  double west = 0, south = 0, east = 0, north = 0;
  for (const Waypoint& at : course.waypoints) {
    west = std::min(west, at.x_m), east = std::max(east, at.x_m);
    south = std::min(south, at.y_m), north = std::max(north, at.y_m);
  }
  add_box(walls_, west - kFence_m, south - kFence_m, east + kFence_m, north + kFence_m);
  for (const Landmark& mark : course.landmarks)
    add_box(walls_, mark.x_m - kPostHalf_m, mark.y_m - kPostHalf_m, mark.x_m + kPostHalf_m, mark.y_m + kPostHalf_m,
            post_m(mark));
}

/// The same with every seed: they belong to the course.
void Surroundings::add_points(const Course& course, const Plan& plan) {
  Chance chance{0, Stream::kMapPoints};
  // Just above its post, so that it is seen from all sides.
  for (const Landmark& mark : course.landmarks)
    points_.push_back({.at_m = {mark.x_m, mark.y_m, post_m(mark) + kOff_m}, .landmark = mark.id});
  for (const Wall& wall : walls_) {
    const double ex = wall.to_x_m - wall.from_x_m, ey = wall.to_y_m - wall.from_y_m;
    const double length_m = sim::sqrt(ex * ex + ey * ey);
    if (wall.surface == Surface::kGlass || length_m < kTexture_m) continue;
    for (const double side_m : {-kOff_m, kOff_m})
      for (double s_m = chance.uniform(0, kTexture_m); s_m < length_m; s_m += kTexture_m * chance.uniform(0.6, 1.4)) {
        const double z_m = wall.low_m + (wall.high_m - wall.low_m) * chance.uniform(0.05, 0.98);
        if (points_.size() < kMostPoints - kMostOnGround)
          points_.push_back({.at_m = {wall.from_x_m + (s_m * ex - side_m * ey) / length_m,
                                      wall.from_y_m + (s_m * ey + side_m * ex) / length_m, z_m}});
      }
  }
  const double every_m = std::max(kTexture_m, plan.length_m() / static_cast<double>(kMostOnGround));
  for (double s_m = 0; s_m < plan.length_m() && points_.size() < kMostPoints; s_m += every_m) {
    const PathPoint at = plan.path(s_m);
    const Direction ahead = direction(at.yaw_rad);
    const double left_m = chance.uniform(-kBeside_m, kBeside_m);
    points_.push_back({.at_m = {at.x_m - left_m * ahead.sin, at.y_m + left_m * ahead.cos, 0}});
  }
}

void Surroundings::add_people(const Plan& plan, std::uint64_t seed) {
  Chance chance{seed, Stream::kPeople};
  for (int i = 0; i < numbers_.count; ++i) {
    const PathPoint at = plan.path(chance.uniform(0, plan.length_m()));
    const double beside_m = i % 2 == 0 ? numbers_.beside_m : -numbers_.beside_m;
    const Direction along = direction(at.yaw_rad);
    const double x_m = at.x_m - beside_m * along.sin, y_m = at.y_m + beside_m * along.cos;
    double way_m = numbers_.way_m;
    for (const Wall& wall : walls_)
      if (const auto stop = hit({{x_m, y_m, 0.5}, {along.cos, along.sin, 0}}, wall))
        way_m = std::min(way_m, std::max(0.1, stop->range_m - 2 * numbers_.radius_m));
    people_.push_back({x_m, y_m, along, way_m, chance.uniform(0, 2 * way_m)});
  }
}

Vector3 Surroundings::person_at(std::size_t person, base::Micros now) const {
  const Person& p = people_[person];
  const double rounds = (p.phase_m + numbers_.speed_mps * static_cast<double>(now.us) * 1e-6) / (2 * p.way_m);
  const double on_m = 2 * p.way_m * (rounds - sim::floor(rounds));
  const double at_m = on_m < p.way_m ? on_m : 2 * p.way_m - on_m;
  return {p.x_m + at_m * p.along.cos, p.y_m + at_m * p.along.sin, 0};
}

std::optional<Hit> Surroundings::nearest(const Ray& ray, base::Micros now, bool through_glass) const {
  std::optional<Hit> first;
  const auto consider = [&first](const std::optional<Hit>& other) {
    if (other && (!first || other->range_m < first->range_m)) first = other;
  };
  for (const Wall& wall : walls_)
    if (!through_glass || wall.surface != Surface::kGlass) consider(hit(ray, wall));
  for (std::size_t i = 0; i < people_.size(); ++i)
    consider(hit(ray, person_at(i, now), numbers_.radius_m, numbers_.height_m));
  if (ray.along[2] < 0) consider(Hit{.range_m = -ray.from_m[2] / ray.along[2], .incidence_cos = -ray.along[2]});
  return first;
}

bool Surroundings::sees(const Vector3& from_m, const Vector3& to_m, base::Micros now) const {
  const Vector3 way = to_m - from_m;
  const double range_m = sim::sqrt(way[0] * way[0] + way[1] * way[1] + way[2] * way[2]);
  const auto first = nearest({from_m, 1 / range_m * way}, now, true);
  return !first || first->range_m > range_m - 1e-6;
}

}  // namespace tetap::sim
