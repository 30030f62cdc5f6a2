// SPDX-License-Identifier: Apache-2.0
// Normals of a scan's points: first from two neighbours on either side, then, inside of a long line, from the whole
// line. A normal from neighbours alone carries their noise, and a corridor would seem to have an end. Near the ends of
// a line its neighbours decide, or lines that grow along the beams would favour one direction.
// Line fit by orthogonal least squares (Pearson, Phil. Mag. 2(11), 1901).
#pragma once

#include "tetap/slam/scan.hpp"

namespace tetap::slam {

struct ScanLineOptions {
  float gap_m = 0.25F;      ///< neighbours farther apart begin another line
  float gap_share = 0.02F;  ///< share of their range that is added
  float flat = 0.05F;       ///< largest ratio of the variances across and along a line
  float fit_m = 0.05F;      ///< distance up to which a point belongs to a long line
  float long_m = 2.0F;      ///< least length of a long line
};

/// Takes the points of a scan one by one, from the first beam to the last, then end().
template <int kBeams>
class ScanLines {
 public:
  explicit ScanLines(const ScanLineOptions& options = {}) : options_(options) {}

  void begin() { line_ = {}; }
  /// Point i; the points before have been taken.
  void take(Scan<kBeams>& scan, int i) {
    joined_[at(i)] = i > 0 && connected(scan.point[at(i - 1)], scan.point[at(i)]);
    if (i >= kSide) set_from_neighbours(scan, i - kSide, i + 1);
    const bool near = line_.count > 0 && joined_[at(i)], bend = near && !fits(scan, i);
    if (!near || bend) end_line(scan, bend);
    if (!scan.point[at(i)].known()) return;
    if (line_.count == 0) first_ = i, begins_at_bend_ = bend;
    line_.add(scan.point[at(first_)], scan.point[at(i)]);
  }
  /// All points have been taken.
  void end(Scan<kBeams>& scan) {
    for (int i = scan.beams - kSide < 0 ? 0 : scan.beams - kSide; i < scan.beams; ++i)
      set_from_neighbours(scan, i, scan.beams);
    end_line(scan, false);
  }

 private:
  static constexpr int kSide = 2;        ///< neighbours on either side
  static constexpr int kLongBeams = 10;  ///< least points of a long line
  static constexpr std::size_t at(int i) { return static_cast<std::size_t>(i); }
  static constexpr float metres(std::int32_t mm) { return 0.001F * static_cast<float>(mm); }

  /// Centre (from an origin), unit normal and the variances across and along.
  struct Fit {
    float mean_x, mean_y, nx, ny, across, along;
  };
  struct Sums {
    int count = 0;
    float x = 0, y = 0, xx = 0, xy = 0, yy = 0;

    void add(const ScanPoint& origin, const ScanPoint& p) {
      const float u = metres(p.x_mm - origin.x_mm), v = metres(p.y_mm - origin.y_mm);
      x += u, y += v;
      xx += u * u, xy += u * v, yy += v * v;
      ++count;
    }
    /// Implements docs/explanation/scan_matching.md (2).
    [[nodiscard]] Fit fit() const {
      const float share = 1.0F / static_cast<float>(count);
      const float mx = x * share, my = y * share;
      const float vx = xx * share - mx * mx, vxy = xy * share - mx * my, vy = yy * share - my * my;
      const float half = 0.5F * (vx - vy), d = base::sqrt(half * half + vxy * vxy), middle = 0.5F * (vx + vy);
      // The direction along has half the angle of (half, vxy); the larger of two forms keeps its digits.
      const float ax = half >= 0.0F ? d + half : vxy, ay = half >= 0.0F ? vxy : d - half;
      const float norm = base::sqrt(ax * ax + ay * ay);
      if (!(norm > 1e-12F)) return {mx, my, 0.0F, 0.0F, middle, middle};
      return {mx, my, -ay / norm, ax / norm, middle - d, middle + d};
    }
  };

  /// Whether both points are there and no gap lies between them. The gap grows with the range of the second.
  [[nodiscard]] bool connected(const ScanPoint& p, const ScanPoint& q) const {
    if (!p.known() || !q.known()) return false;
    const float x = metres(q.x_mm), y = metres(q.y_mm);
    const float dx = metres(q.x_mm - p.x_mm), dy = metres(q.y_mm - p.y_mm);
    const float gap = options_.gap_m + options_.gap_share * base::sqrt(x * x + y * y);
    return dx * dx + dy * dy < gap * gap;
  }
  /// Point i, of which those before `end` have been taken.
  void set_from_neighbours(Scan<kBeams>& scan, int i, int end) const {
    ScanPoint& p = scan.point[at(i)];
    if (!p.known() || p.has_normal()) return;
    Sums sums;
    sums.count = 1;  // the point itself, at the origin
    for (int k = i; k > i - kSide && joined_[at(k)]; --k) sums.add(p, scan.point[at(k - 1)]);
    for (int k = i + 1; k < end && k <= i + kSide && joined_[at(k)]; ++k) sums.add(p, scan.point[at(k)]);
    if (sums.count < 3) return;
    const Fit line = sums.fit();
    if (line.across < options_.flat * line.along) set_normal(p, line);
  }
  [[nodiscard]] bool fits(const Scan<kBeams>& scan, int i) const {
    if (line_.count < 2) return true;
    const ScanPoint &p = scan.point[at(i)], &origin = scan.point[at(first_)];
    const Fit line = line_.fit();
    const float e =
        line.nx * (metres(p.x_mm - origin.x_mm) - line.mean_x) + line.ny * (metres(p.y_mm - origin.y_mm) - line.mean_y);
    return base::abs(e) < options_.fit_m;
  }
  /// A bend leaves the line's outermost points to their neighbours; where the wall ends, they are as good as others.
  void end_line(Scan<kBeams>& scan, bool at_bend) {
    const int begin = first_ + (begins_at_bend_ ? kSide : 0), end = first_ + line_.count - (at_bend ? kSide : 0);
    if (line_.count >= kLongBeams) {
      const Fit line = line_.fit();
      if (12.0F * line.along > options_.long_m * options_.long_m)  // evenly spread, it would be so long
        for (int i = begin; i < end; ++i) set_normal(scan.point[at(i)], line);
    }
    line_ = {};
  }
  /// Towards the scanner.
  static void set_normal(ScanPoint& p, const Fit& line) {
    const bool away = line.nx * static_cast<float>(p.x_mm) + line.ny * static_cast<float>(p.y_mm) > 0.0F;
    const float scale = (away ? -1.0F : 1.0F) / ScanPoint::kNormal;
    p.nx = static_cast<std::int16_t>(nearest(scale * line.nx));
    p.ny = static_cast<std::int16_t>(nearest(scale * line.ny));
  }

  ScanLineOptions options_;
  int first_ = 0;
  bool begins_at_bend_ = false;
  std::array<bool, kBeams> joined_{};  ///< to the point before
  Sums line_{};                        ///< from the line's first point
};

}  // namespace tetap::slam
