// SPDX-License-Identifier: Apache-2.0
// A simulated world of landmarks on both sides of a circular course, with clutter if asked for. It has a truth of its
// own in double, and noise of the size that is given to the filter.
#pragma once

#include "tetap/model/planar_increment.hpp"
#include "tetap/slam/sighting.hpp"

#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

namespace tetap::test {

struct LandmarkWorld {
  struct Seen {
    slam::Sighting sighting;
    int landmark;  ///< -1: clutter
  };
  static constexpr double kStep_s = 0.1, kSpeed_mps = 1, kTurn_radps = 0.1;
  static constexpr int kStepsOfALap = 628;

  std::mt19937 random;
  std::normal_distribution<double> normal;
  std::vector<std::array<double, 2>> landmarks;
  double x_m = 0, y_m = 0, yaw_rad = 0;
  double walk_m2ps = 0.0025, turn_rad2ps = 0.0016;  ///< noise of the motion
  double sigma_range_m = 0.1, sigma_bearing_rad = 0.02, reach_m = 6;
  double clutter = 0;  ///< false sightings a look, on average

  explicit LandmarkWorld(unsigned seed, int count = 30) : random(seed) {
    for (int i = 0; i < count; ++i) {
      const double angle = 2 * M_PI * i / count, radius = i % 2 == 0 ? 7 : 13;
      landmarks.push_back({radius * std::cos(angle), 10 + radius * std::sin(angle)});
    }
  }
  /// One step of the course; the command with its noise as the filter is told.
  model::PlanarIncrement drive() {
    const double ds = kSpeed_mps * kStep_s, dyaw = kTurn_radps * kStep_s;
    const double s = ds + std::sqrt(walk_m2ps * kStep_s) * normal(random);
    const double w = dyaw + std::sqrt(turn_rad2ps * kStep_s) * normal(random);
    const double chord = std::abs(w) < 1e-9 ? 1 : std::sin(w / 2) / (w / 2);
    x_m += s * chord * std::cos(yaw_rad + w / 2), y_m += s * chord * std::sin(yaw_rad + w / 2);
    yaw_rad = std::remainder(yaw_rad + w, 2 * M_PI);
    return {.ds_m = static_cast<float>(ds),
            .dyaw_rad = static_cast<float>(dyaw),
            .var_ds = static_cast<float>(walk_m2ps * kStep_s),
            .var_dyaw = static_cast<float>(turn_rad2ps * kStep_s)};
  }
  /// Sightings of the landmarks within reach ahead, and clutter.
  std::vector<Seen> look() {
    std::vector<Seen> seen;
    for (std::size_t i = 0; i < landmarks.size(); ++i) {
      const double dx = landmarks[i][0] - x_m, dy = landmarks[i][1] - y_m, range = std::hypot(dx, dy);
      const double bearing = std::remainder(std::atan2(dy, dx) - yaw_rad, 2 * M_PI);
      if (range > reach_m || std::abs(bearing) > M_PI / 2) continue;
      seen.push_back({measured(range, bearing), static_cast<int>(i)});
    }
    std::uniform_real_distribution<double> uniform(0, 1);
    if (uniform(random) < clutter)
      seen.push_back({measured(1 + (reach_m - 1) * uniform(random), M_PI * (uniform(random) - 0.5)), -1});
    return seen;
  }

 private:
  slam::Sighting measured(double range, double bearing) {
    slam::Sighting s;
    s.range_m = static_cast<float>(range + sigma_range_m * normal(random));
    s.bearing_rad = static_cast<float>(bearing + sigma_bearing_rad * normal(random));
    return s;
  }
};

/// e^T P^-1 e for a symmetric 3 x 3 P.
template <class P>
[[nodiscard]] double nees_of(const std::array<double, 3>& e, const P& p) {
  const auto at = [&](int r, int c) { return static_cast<double>(p(r, c)); };
  const double a = at(0, 0), b = at(0, 1), c = at(0, 2), d = at(1, 1), f = at(1, 2), g = at(2, 2);
  const double i00 = d * g - f * f, i01 = c * f - b * g, i02 = b * f - c * d, i11 = a * g - c * c, i12 = b * c - a * f,
               i22 = a * d - b * b;
  const double det = a * i00 + b * i01 + c * i02;
  return (e[0] * e[0] * i00 + e[1] * e[1] * i11 + e[2] * e[2] * i22 +
          2 * (e[0] * e[1] * i01 + e[0] * e[2] * i02 + e[1] * e[2] * i12)) /
         det;
}

}  // namespace tetap::test
