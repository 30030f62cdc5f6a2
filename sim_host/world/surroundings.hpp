// SPDX-License-Identifier: Apache-2.0
// The one map that a scanner and a camera see: walls, the ground, people who walk, and points that a camera can follow.
// Frame: that of the course, with the ground at z = 0.
#pragma once

#include "sim_host/world/course.hpp"
#include "sim_host/world/rotation.hpp"
#include "sim_host/world/sight_numbers.hpp"
#include "sim_host/world/walls.hpp"
#include "tetap/base/time.hpp"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace tetap::sim {

/// A half line; `along` has the length 1.
struct Ray {
  Vector3 from_m{};
  Vector3 along{};
};

struct Hit {
  double range_m = 0;
  double incidence_cos = 1;  ///< 1: square to the surface
  Surface surface = Surface::kPlain;
};

/// A point of the map that looks the same from everywhere.
struct MapPoint {
  Vector3 at_m{};
  std::uint8_t landmark = 0;  ///< id of the landmark that it is; 0: none
};

class Surroundings {
 public:
  /// Walls of the course; where it has none, a fence 6 m around it, and a post at each landmark.
  Surroundings(const Course& course, const Plan& plan, const PeopleNumbers& people, std::uint64_t seed);

  /// The nearest surface on the way at that time after the start. `through_glass`: panes are not there.
  [[nodiscard]] std::optional<Hit> nearest(const Ray& ray, base::Micros now, bool through_glass) const;
  /// Whether nothing but glass is between the two.
  [[nodiscard]] bool sees(const Vector3& from_m, const Vector3& to_m, base::Micros now) const;

  [[nodiscard]] std::span<const Wall> walls() const { return walls_; }
  /// Landmarks first, then points on the walls and on the ground beside the way.
  [[nodiscard]] std::span<const MapPoint> points() const { return points_; }
  [[nodiscard]] std::size_t people() const { return people_.size(); }
  /// Where the feet of that person are.
  [[nodiscard]] Vector3 person_at(std::size_t person, base::Micros now) const;

 private:
  struct Person {
    double x_m, y_m;
    Direction along;
    double way_m, phase_m;
  };
  void add_fence(const Course& course);
  void add_points(const Course& course, const Plan& plan);
  void add_people(const Plan& plan, std::uint64_t seed);

  PeopleNumbers numbers_;
  std::vector<Wall> walls_;
  std::vector<MapPoint> points_;
  std::vector<Person> people_;
};

}  // namespace tetap::sim
