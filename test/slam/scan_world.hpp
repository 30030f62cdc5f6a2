// SPDX-License-Identifier: Apache-2.0
// Scans in rooms whose walls are cast by determinants in double, and motions with their covariance.
#pragma once

#include "support/scan_room.hpp"
#include "tetap/slam/planar_motion.hpp"
#include "tetap/slam/scan.hpp"

#include <random>
#include <vector>

namespace tetap::test {

using Ranges = std::vector<std::uint16_t>;
using Motion = slam::UncertainDisplacement<float>;
struct Place {
  double x = 0, y = 0, yaw = 0;
};
inline const std::vector<Wall> kCorridor = {{-60, -1, 60, -1}, {-60, 1.2, 60, 1.2}};
inline const slam::ScanGeometry kTurn{
    .beams = 360, .first_rad = -base::kPi, .step_rad = base::kPi / 180, .max_m = 12.0F};

inline double bearing(const slam::ScanGeometry& g, int i) {
  return static_cast<double>(g.first_rad) + static_cast<double>(g.step_rad) * i;
}
inline Ranges look(const std::vector<Wall>& walls, const slam::ScanGeometry& g, const Place& at, double sigma_m,
                   std::mt19937& random) {
  std::normal_distribution<double> noise;
  Ranges ranges;
  for (int i = 0; i < g.beams; ++i)
    ranges.push_back(range_steps(cast(walls, at.x, at.y, at.yaw + bearing(g, i)) + sigma_m * noise(random)));
  return ranges;
}
inline Motion motion(double x, double y, double yaw, double sigma_m, double sigma_rad) {
  const auto m = static_cast<float>(sigma_m * sigma_m), r = static_cast<float>(sigma_rad * sigma_rad);
  return {.mean = {static_cast<float>(x), static_cast<float>(y),
                   slam::Heading<float>::from_radians(static_cast<float>(yaw))},
          .covariance = filter::Symmetric<float, 3>::diagonal({m, m, r})};
}

}  // namespace tetap::test
