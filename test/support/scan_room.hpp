// SPDX-License-Identifier: Apache-2.0
// A room whose walls are cast by determinants in double, for tests of scan matching.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace tetap::test {

struct Wall {
  double x0, y0, x1, y1;
};
/// A room of 8 m by 6 m with a pillar and a niche.
inline const std::vector<Wall> kRoom = {{-4, -3, 4, -3},   {4, -3, 4, 3},       {4, 3, 1, 3},       {1, 3, 1, 3.8},
                                        {1, 3.8, -1, 3.8}, {-1, 3.8, -1, 3},    {-1, 3, -4, 3},     {-4, 3, -4, -3},
                                        {2, -1, 2.4, -1},  {2.4, -1, 2.4, -.6}, {2.4, -.6, 2, -.6}, {2, -.6, 2, -1}};
/// Distance along a ray to the nearest wall by Cramer's rule, in m; 1e9 where there is none.
[[nodiscard]] inline double cast(const std::vector<Wall>& walls, double x, double y, double bearing) {
  double nearest = 1e9;
  const double dx = std::cos(bearing), dy = std::sin(bearing);
  for (const Wall& w : walls) {
    const double ex = w.x1 - w.x0, ey = w.y1 - w.y0, det = ex * dy - ey * dx;
    if (std::abs(det) < 1e-12) continue;
    const double range = (ex * (w.y0 - y) - ey * (w.x0 - x)) / det, part = (dx * (w.y0 - y) - dy * (w.x0 - x)) / det;
    if (range > 0 && part >= 0 && part <= 1) nearest = std::min(nearest, range);
  }
  return nearest;
}
[[nodiscard]] inline std::uint16_t range_steps(double range_m) {
  return range_m > 40 ? 0 : static_cast<std::uint16_t>(range_m / 0.005 + 0.5);
}

}  // namespace tetap::test
