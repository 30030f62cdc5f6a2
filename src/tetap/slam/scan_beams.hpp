// SPDX-License-Identifier: Apache-2.0
// A few points of a scan, as seen from the body, and how well a map has them from a pose.
#pragma once

#include "tetap/base/math.hpp"
#include "tetap/filter/particle_pose.hpp"
#include "tetap/slam/likelihood_field.hpp"
#include "tetap/slam/planar_motion.hpp"
#include "tetap/slam/scan.hpp"

#include <array>

namespace tetap::slam {

struct ScanBeams {
  static constexpr int kMost = 40;
  struct Point {
    float x_m = 0, y_m = 0;
  };

  std::array<Point, kMost> point{};
  int count = 0;

  /// Evenly over the points that the scan has; `mounting`: the scanner on the body.
  template <int kBeams>
  [[nodiscard]] static ScanBeams of(const Scan<kBeams>& scan, const Displacement<float>& mounting) {
    ScanBeams beams;
    const auto turn = mounting.yaw.direction();
    int left = scan.known, wanted = left < kMost ? left : kMost, passed = 0;
    for (int i = 0; i < scan.beams && beams.count < wanted; ++i) {
      const ScanPoint& p = scan.point[static_cast<std::size_t>(i)];
      if (!p.known()) continue;
      if (passed++ * wanted / left < beams.count) continue;
      const float x = 0.001F * static_cast<float>(p.x_mm), y = 0.001F * static_cast<float>(p.y_mm);
      beams.point[static_cast<std::size_t>(beams.count++)] = {mounting.x_m + turn.cos * x - turn.sin * y,
                                                              mounting.y_m + turn.sin * x + turn.cos * y};
    }
    return beams;
  }
  /// Calls f with the level of each point on the map.
  template <class F>
  void each_level(const filter::ParticlePose& pose, const LikelihoodField& field, F&& f) const {
    const float per_cell = 1.0F / field.cell_m;
    const float x = (pose.x_m - field.low_x_m) * per_cell, y = (pose.y_m - field.low_y_m) * per_cell;
    const float c = pose.cos_yaw * per_cell, s = pose.sin_yaw * per_cell;
    for (int i = 0; i < count; ++i) {
      const Point& b = point[static_cast<std::size_t>(i)];
      f(field.level(cell(x + c * b.x_m - s * b.y_m), cell(y + s * b.x_m + c * b.y_m)));
    }
  }
  /// A level in a score: most in a wall, nothing far from all.
  [[nodiscard]] static constexpr int worth(int level) {
    return level < LikelihoodField::kFar ? LikelihoodField::kFar - level : 0;
  }
  [[nodiscard]] int score(const filter::ParticlePose& pose, const LikelihoodField& field) const {
    int sum = 0;
    each_level(pose, field, [&sum](int level) { sum += worth(level); });
    return sum;
  }

 private:
  /// The cell of a coordinate; -1 below the map and beyond all.
  [[nodiscard]] static int cell(float v) { return v >= 0.0F && v < 65536.0F ? static_cast<int>(v) : -1; }
};

}  // namespace tetap::slam
