// SPDX-License-Identifier: Apache-2.0
// Scan matching's workload: 360 beams in a room of 8 m by 6 m with a pillar, the prior 0.04 m and up to
// 0.12 rad off. A whole match against one keyframe and against four, and the tick of robot scanner (4 000 units).
#include "board.hpp"
#include "markers.hpp"
#include "tetap/base/random.hpp"
#include "tetap/slam/scan_match.hpp"

#include <array>

namespace {

using namespace tetap;
using count::opaque;
using count::Region;

constexpr int kBeams = 360;
using Ranges = std::array<std::uint16_t, kBeams>;
using Motion = slam::UncertainDisplacement<float>;
constexpr slam::ScanGeometry kTurn{.beams = kBeams, .first_rad = -3.14159F, .step_rad = 0.0174533F, .max_m = 12.0F};

/// Range in steps of 5 mm: the nearest of four walls, and of a pillar of 0.3 m at (2, -1).
std::uint16_t range_of(float x, float y, float bearing, base::Random& noise) {
  const base::SinCos u = base::sincos(base::wrap_angle(bearing));
  float range = 20.0F;
  if (base::abs(u.cos) > 1e-3F) range = base::min(range, ((u.cos > 0.0F ? 4.0F : -4.0F) - x) / u.cos);
  if (base::abs(u.sin) > 1e-3F) range = base::min(range, ((u.sin > 0.0F ? 3.0F : -3.0F) - y) / u.sin);
  const float along = (2.0F - x) * u.cos + (-1.0F - y) * u.sin, across = (-1.0F - y) * u.cos - (2.0F - x) * u.sin;
  if (along > 0.0F && base::abs(across) < 0.3F) range = base::min(range, along - base::sqrt(0.09F - across * across));
  return static_cast<std::uint16_t>((range + 0.01F * noise.normal()) / 0.005F);
}

/// Robot scanner's match with this many keyframes, of three scans.
template <int kFrames, class Whole, class Tick>
void matches() {
  static slam::ScanMatch<kBeams, kFrames> match;
  static slam::ScanKeyframes<kBeams, kFrames> keyframes;
  static Ranges ranges;
  base::Random noise(1);
  Motion prior{.covariance = filter::Symmetric<float, 3>::diagonal({1e-2F, 1e-2F, 1e-2F})};
  slam::GraphPose<float> pose;
  for (int k = 0; k < kFrames + 3; ++k) {
    const float n = k < kFrames ? 3.0F : static_cast<float>(k - kFrames + 1);  // thirds of the way to a keyframe
    const slam::GraphPose<float> newest = k > 0 ? keyframes.pose(0) : pose;
    if (k > 0) pose = newest.plus({0.1F * n, 0.02F, slam::Heading<float>::from_radians(0.04F * n)});
    prior.mean = {.x_m = 0.1F * n + 0.03F};
    for (int i = 0; i < kBeams; ++i)
      ranges[static_cast<std::size_t>(i)] =
          range_of(pose.x.metres(), pose.y.metres(),
                   pose.yaw.radians() + kTurn.first_rad + kTurn.step_rad * static_cast<float>(i), noise);
    opaque(ranges);
    if (k < kFrames) {
      static_cast<void>(match.begin(kTurn, {}, prior));
      match.work(2 * kBeams, ranges, keyframes);
      match.cancel();
      keyframes.add(match.scan(), pose);
      continue;
    }
    {
      const Region<Whole> region;
      static_cast<void>(match.begin(kTurn, {}, prior));
      match.work(1'000'000, ranges, keyframes);
    }
    opaque(match);
    static_cast<void>(match.begin(kTurn, {}, prior));
    while (match.busy()) {
      const Region<Tick> region;
      match.work(4'000, ranges, keyframes);
    }
    opaque(match);
  }
}

}  // namespace

int main() {
  static Board board;
  count::calibrate();
  matches<1, struct scan_match_1, struct scan_tick_1>();
  matches<4, struct scan_match_4, struct scan_tick_4>();
  board.print("count: done\n");
  count::finish();
  return 0;
}
