// SPDX-License-Identifier: Apache-2.0
// The pose grid's workload: 24 576 cells, the robot of config/mrclam_grid.hpp on a circle of 3 m among four landmarks,
// which are seen again as soon as a step of the grid is done. A tick does 100 lines of a step; there is no start pose.
#include "board.hpp"
#include "config/mrclam_grid.hpp"
#include "markers.hpp"
#include "tetap/base/random.hpp"

namespace {

using namespace tetap;
using count::opaque;
using count::Region;

using Grid = estimators::PoseGrid<16, 32, 48>;
constexpr int kTicks = 320;
constexpr std::int64_t kTick_us = 10'000;

struct Truth {
  float x_m = 0, y_m = 0, yaw_rad = 0;

  /// 1 m/s for a tick.
  void move() {
    const base::SinCos at = base::sincos(yaw_rad);
    x_m += 0.01F * at.cos;
    y_m += 0.01F * at.sin;
    yaw_rad = base::wrap_angle(yaw_rad + 0.01F / 3);
  }
  [[nodiscard]] sensor::LandmarkSighting sighting_of(const model::Landmark& landmark, std::uint8_t id,
                                                     base::Random& noise) const {
    const float dx = landmark.x.minus({}) - x_m, dy = landmark.y.minus({}) - y_m;
    return {.landmark = id,
            .range_m = base::sqrt(dx * dx + dy * dy) + 0.1F * noise.normal(),
            .bearing_rad = base::wrap_angle(base::atan2(dy, dx) - yaw_rad + 0.02F * noise.normal())};
  }
};

/// False: a sighting was not taken, or the robot was not found, so that nothing was counted that a user has.
bool pose_grid() {
  static estimators::LandmarkMap<estimators::kMapCapacity> map;
  for (const estimators::MapEntry& entry : {estimators::MapEntry{2000, 0, 1}, estimators::MapEntry{-2000, 1000, 2},
                                            estimators::MapEntry{1000, 7000, 3}, estimators::MapEntry{-1500, 5000, 4}})
    static_cast<void>(map.put(entry));
  static estimators::MapFrame frame;
  frame.map = &map;
  const estimators::Context ctx{.parameters = robot::mrclam_grid::parameters, .map_frame = frame};
  static Grid grid;
  grid.restart({}, ctx);
  base::Random noise(1);
  Truth truth;
  bool taken = true;
  for (int k = 1; k <= kTicks; ++k) {
    const base::Micros t{k * kTick_us};
    truth.move();
    static_cast<void>(grid.fuse(sensor::BodySpeed{.forward_mps = 1.0F, .yaw_rate_radps = 1.0F / 3}, t, ctx));
    if (!grid.job().busy())
      for (std::uint8_t id = 1; id <= 4; ++id)
        taken = taken &&
                grid.fuse(truth.sighting_of(*map.find(id), id, noise), t, ctx).verdict != sensor::Verdict::kNotUsed;
    grid.advance(t, ctx, {});
    const Region<struct pose_grid_work> region;
    grid.work(static_cast<std::uint32_t>(ctx.parameters.loop.work_units), ctx);
  }
  const bool found = grid.estimate(ctx).position_valid;
  opaque(grid);
  return taken && found;
}

}  // namespace

int main() {
  static Board board;
  count::calibrate();
  if (!pose_grid()) {
    board.print("count_grid: the robot was not found\n");
    return 1;
  }
  board.print("count: done\n");
  count::finish();
  return 0;
}
