// SPDX-License-Identifier: Apache-2.0
// Mappers on MRCLAM, data set 7: the motion that one configuration makes of the commands, and errors after the rigid
// motion that fits the map's landmarks.
#pragma once

#include "config/mrclam_slam.hpp"
#include "landmark_world.hpp"
#include "support/mrclam.hpp"
#include "tetap/model/planar_increment.hpp"
#include "tetap/sensor/calibration.hpp"
#include "tetap/slam/sighting.hpp"

#include <cmath>
#include <map>
#include <vector>

namespace tetap::test {

[[nodiscard]] inline double d(float v) { return static_cast<double>(v); }
[[nodiscard]] inline float f(double v) { return static_cast<float>(v); }

/// The command as a robot of these parameters takes it; Mrclam's own scale of the turn is taken out.
[[nodiscard]] inline model::PlanarIncrement increment_of(const Mrclam::Command& command, double dt_s,
                                                         const param::WheelParameters& n) {
  const double rate = command.yaw_rate_radps * d(n.yaw_rate_scale) / Mrclam::kTurnScale;
  const double of_turn = d(n.noise.yaw_rate_per_yaw_rate) * std::abs(rate);
  const double of_speed = d(n.noise.yaw_rate_per_speed) * std::abs(command.forward_mps);
  return {.ds_m = f(command.forward_mps * d(n.speed_scale) * dt_s),
          .dyaw_rad = f(rate * dt_s),
          .var_ds = f(d(n.noise.speed) * dt_s),
          .var_dyaw = f((d(n.noise.yaw_rate) + of_turn + of_speed) * dt_s)};
}
[[nodiscard]] inline slam::SightingNoise noise_of(const param::LandmarkParameters& n) {
  return {.sigma_range_m = n.sigma_range_m,
          .sigma_range_per_m = n.sigma_range_per_m,
          .sigma_bearing_rad = n.sigma_bearing_rad};
}

struct Point {
  double x, y;
};
struct Track {
  std::vector<Mrclam::Pose> poses;
  std::map<int, Point> map;  ///< by barcode
  double nees = 0;
  int looks = 0;

  template <class P>
  void add(const Mrclam& run, double t_s, double x, double y, double yaw, const P& p) {
    Mrclam::Pose truth{};
    if (!run.truth_at(t_s, truth)) return;
    poses.push_back({t_s, x, y, yaw});
    nees += nees_of({truth.x_m - x, truth.y_m - y, std::remainder(truth.yaw_rad - yaw, 2 * M_PI)}, p);
    ++looks;
  }
};
struct Figures {
  double trajectory_m = 0, map_m = 0, nees = 0;
};

/// Errors after the rigid motion that takes the estimated landmarks nearest to the true ones (Horn 1987, planar).
[[nodiscard]] inline Figures figures_of(const Track& track, const Mrclam& run) {
  Point from{}, to{};
  const auto n = static_cast<double>(track.map.size());
  for (const auto& [barcode, at] : track.map) {
    const auto& place = run.landmarks.at(barcode);
    from.x += at.x / n, from.y += at.y / n, to.x += place[0] / n, to.y += place[1] / n;
  }
  double dot = 0, cross = 0;
  for (const auto& [barcode, at] : track.map) {
    const auto& place = run.landmarks.at(barcode);
    dot += (at.x - from.x) * (place[0] - to.x) + (at.y - from.y) * (place[1] - to.y);
    cross += (at.x - from.x) * (place[1] - to.y) - (at.y - from.y) * (place[0] - to.x);
  }
  const double turn = std::atan2(cross, dot);
  const auto squared = [&](double x, double y, double true_x, double true_y) {
    const double ex = x - from.x, ey = y - from.y;
    return std::pow(to.x + std::cos(turn) * ex - std::sin(turn) * ey - true_x, 2) +
           std::pow(to.y + std::sin(turn) * ex + std::cos(turn) * ey - true_y, 2);
  };
  Figures figures;
  for (const auto& [barcode, at] : track.map) {
    const auto& place = run.landmarks.at(barcode);
    figures.map_m += squared(at.x, at.y, place[0], place[1]) / n;
  }
  for (const Mrclam::Pose& pose : track.poses) {
    Mrclam::Pose truth{};
    if (run.truth_at(pose.t_s, truth)) figures.trajectory_m += squared(pose.x_m, pose.y_m, truth.x_m, truth.y_m);
  }
  figures.trajectory_m = std::sqrt(figures.trajectory_m / static_cast<double>(track.poses.size()));
  figures.map_m = std::sqrt(figures.map_m);
  figures.nees = track.nees / track.looks;
  return figures;
}

[[nodiscard]] inline model::PlanarPose start_of(const Mrclam& run) {
  return {.x = base::Anchored{}.plus(f(run.start().x_m)),
          .y = base::Anchored{}.plus(f(run.start().y_m)),
          .yaw_rad = f(run.start().yaw_rad)};
}
/// With the camera's own errors taken out, as the robot mrclam_slam does.
[[nodiscard]] inline slam::Sighting sighting_of(const Mrclam::Sighting& one) {
  sensor::LandmarkSighting seen{.range_m = f(one.range_m), .bearing_rad = f(one.bearing_rad)};
  sensor::calibrate(seen, robot::mrclam_slam::parameters.landmark);
  return {.id = static_cast<std::uint16_t>(one.barcode), .range_m = seen.range_m, .bearing_rad = seen.bearing_rad};
}

}  // namespace tetap::test
