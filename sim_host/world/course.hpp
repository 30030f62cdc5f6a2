// SPDX-License-Identifier: Apache-2.0
// A test course: waypoints joined by straight lines, every corner rounded by an arc. A time plan drives it within
// limits of speed, acceleration, lateral acceleration and yaw rate.
#pragma once

#include "sim_host/world/walls.hpp"
#include "tetap/base/time.hpp"

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace tetap::sim {

struct Landmark {
  std::uint8_t id = 0;
  double x_m = 0;
  double y_m = 0;
};

struct Waypoint {
  double x_m = 0;
  double y_m = 0;
  double radius_m = 0;  ///< corner's arc; 0 at the two ends and where the line goes straight on
  double stop_s = 0;    ///< standstill there; only where radius_m = 0
};

struct CourseLimits {
  double speed_mps = 2.0;
  double acceleration_mps2 = 0.8;
  double lateral_mps2 = 0.8;
  double yaw_rate_radps = 1.2;
};

struct Course {
  std::vector<Waypoint> waypoints;
  std::vector<Landmark> landmarks;
  std::vector<Wall> walls = {};  ///< none: what there is to see is made from the rest (surroundings.hpp)
};

/// Proving ground of 52 m x 30 m: straights, two skid pads (one each way), slalom, hairpin, standstill at the start, in
/// the middle, at the end.
[[nodiscard]] Course default_course();
/// The default course, driven so many times, with a standstill between.
[[nodiscard]] Course default_course(int laps);
/// A road of 1.1 km for 5 m/s and more, driven so many times: long curves both ways, standstill at the start and once a
/// lap.
[[nodiscard]] Course road_course(int laps);
/// Streets for a car at up to 12 m/s, driven so many times: corners of 10 to 15 m both ways, a light, a bend in S.
[[nodiscard]] Course street_course(int laps);
/// Legs for a multicopter at up to 5 m/s, flown so many times, with a hover half way and once a lap.
[[nodiscard]] Course flight_course(int laps);
/// A square with rounded corners, `length_m` long in one lap, with standstill at the start and at the end. The given
/// number of landmarks stands in turn 2 m to the right and to the left of the way. A loop below 20 m, and one with less
/// than 4 or more than 254 landmarks, has no waypoints, so that no plan takes it.
[[nodiscard]] Course loop_course(double length_m, int laps, int landmarks);
/// A straight lead-in and full circles to the left, for laws that have closed forms.
[[nodiscard]] Course circle_course(double radius_m, int turns);

struct PathPoint {
  double x_m = 0;
  double y_m = 0;
  double yaw_rad = 0;          ///< continuous: two turns to the left add 4 pi
  double curvature_per_m = 0;  ///< positive to the left
};

/// Place, speed and acceleration that the driver wants at a time.
struct PlanPoint {
  double s_m = 0;
  double speed_mps = 0;
  double acceleration_mps2 = 0;
  bool parked = false;
};

/// The course as a function of path length, and path length as a function of time.
class Plan {
 public:
  /// Why the waypoints cannot be driven: a corner whose arc does not fit, a stop in a corner; empty where they can.
  [[nodiscard]] static std::string refusal(const Course& course);
  /// Ends the program where the course is refused.
  Plan(const Course& course, const CourseLimits& limits);

  [[nodiscard]] PathPoint path(double s_m) const;
  [[nodiscard]] PlanPoint at(base::Micros since_start) const;
  /// The first time at which the plan is at path length s_m.
  [[nodiscard]] base::Micros time_at(double s_m) const;
  [[nodiscard]] double length_m() const { return length_m_; }
  [[nodiscard]] base::Micros duration() const { return duration_; }
  /// Times at which the plan first leaves a stop, and last arrives.
  [[nodiscard]] double departure_s() const { return stops_m_.empty() || stops_m_.front() > 0 ? 0 : stops_s_.front(); }
  [[nodiscard]] double arrival_s() const { return arrival_s_; }

 private:
  struct Piece {
    double s_m, length_m, curvature_per_m, x_m, y_m, yaw_rad;
  };
  struct Node {
    double s_m, speed_mps, time_s;  ///< two nodes with the same s_m bracket a standstill
  };
  Plan() = default;
  /// Returns the refusal.
  std::string add_pieces(const Course& course);
  void add_speeds(const CourseLimits& limits);
  [[nodiscard]] const Piece& piece(double s_m) const;

  std::vector<Piece> pieces_;
  std::vector<double> stops_m_;  ///< path length of every waypoint with a standstill
  std::vector<double> stops_s_;
  std::vector<Node> nodes_;
  double length_m_ = 0;
  double arrival_s_ = 0;
  base::Micros duration_;
};

}  // namespace tetap::sim
