// SPDX-License-Identifier: Apache-2.0
// The robot scanner_localize in the laboratory of the simulated world: switched on at 20 places of its drive, without a
// pose, on its own map.
#include "config/scanner_localize.hpp"
#include "published_pose.hpp"
#include "sim_host/robot_world.hpp"
#include "sim_host/world/floor_plan.hpp"
#include "sim_host/world_source.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <vector>

namespace tetap::sim {
namespace {

using Estimators = robot::scanner_localize::Estimators;
constexpr const param::Parameters& kNumbers = robot::scanner_localize::parameters;

struct Epoch {
  std::vector<base::CanFrame> inputs;
  base::Micros time;
  Truth truth;
  double way_m = 0;
};
/// A lap of the laboratory; the node gets no pose.
std::vector<Epoch> lap(std::uint64_t seed) {
  const Sent sent = sent_to({.scans = true, .given_map = true}, kNumbers);
  World::Options world;
  simulate("scanner_localize", sent, kNumbers, world);
  EXPECT_TRUE(set_course(usual_course(sent), sent.kind, 1, {}, world));
  send_only(sent, world);
  WorldSource source(World(world, seed), kNumbers.can_base, base::Micros{10'000}, base::Micros{200'000'000}, false);
  std::vector<Epoch> epochs;
  Tick tick;
  while (source.next(tick)) {
    Epoch one{.inputs = {tick.inputs.begin(), tick.inputs.end()}, .time = tick.time, .truth = source.truth()};
    if (!epochs.empty()) {
      const Truth& before = epochs.back().truth;
      one.way_m = epochs.back().way_m + std::hypot(one.truth.x_m - before.x_m, one.truth.y_m - before.y_m);
    }
    epochs.push_back(one);
  }
  return epochs;
}

double distance_to(const Wall& w, double x_m, double y_m) {
  const double ex = w.to_x_m - w.from_x_m, ey = w.to_y_m - w.from_y_m;
  const double part = std::clamp(((x_m - w.from_x_m) * ex + (y_m - w.from_y_m) * ey) / (ex * ex + ey * ey), 0.0, 1.0);
  return std::hypot(w.from_x_m + part * ex - x_m, w.from_y_m + part * ey - y_m);
}

/// The map among the robot's data, which scanner_map made, against the walls of the world, both ways.
TEST(ScanLocalizerInTheWorld, TheMapIsTheFloorPlan) {
  const slam::LikelihoodField& map = Estimators::kField;
  const Course course = lab_course(1);
  const double cell_m = static_cast<double>(map.cell_m), low_x_m = static_cast<double>(map.low_x_m),
               low_y_m = static_cast<double>(map.low_y_m);
  int walls = 0, off = 0;
  for (int y = 0; y < map.rows * map.kTile; ++y)
    for (int x = 0; x < map.columns * map.kTile; ++x) {
      if (map.level(x, y) > 0) continue;
      double least = 1e9;
      for (const Wall& w : course.walls)
        least = std::min(least, distance_to(w, low_x_m + cell_m * (x + 0.5), low_y_m + cell_m * (y + 0.5)));
      ++walls;
      off += least > 0.2 ? 1 : 0;
    }
  EXPECT_GT(walls, 400);
  EXPECT_LT(off, walls / 20);
  const auto from_the_map = [&](double x_m, double y_m) {
    return static_cast<double>(map.step_m) *
           map.level(static_cast<int>((x_m - low_x_m) / cell_m), static_cast<int>((y_m - low_y_m) / cell_m));
  };
  for (double x_m = 13.2; x_m < 20; x_m += 0.2) {  // the core, up to the cupboard before it
    EXPECT_LT(from_the_map(x_m, 9), 0.2) << x_m;
    EXPECT_GT(from_the_map(x_m, 7.75), 0.8) << x_m;
  }
}

TEST(ScanLocalizerInTheWorld, FindsItselfInTheLaboratoryFromAnywhere) {
  constexpr double kWay_m = 15, kDegree = 57.29577951;
  const std::vector<Epoch> epochs = lap(1);
  std::size_t last = epochs.size() - 1;
  while (epochs.back().way_m - epochs[last].way_m < kWay_m) --last;
  int found = 0, beyond = 0;
  for (std::size_t place = 0; place < 20; ++place) {
    const std::size_t from = 1 + place * (last - 1) / 19;
    const auto node = std::make_unique<node::Node<Estimators>>(kNumbers, bus::Version{});
    node->power_on(epochs[from - 1].time);
    Published out;
    bool valid = false;
    double worst = 0, off_m = 0, off_rad = 0, valid_m = -1;
    for (std::size_t k = from; k < epochs.size() && epochs[k].way_m < epochs[from].way_m + kWay_m; ++k) {
      const Epoch& now = epochs[k];
      for (const base::CanFrame& frame : now.inputs) node->on_frame(frame);
      node->tick(now.time, {}, [&](const base::CanFrame& frame) {
        const std::uint32_t offset = frame.id - kNumbers.can_base;
        out.take(offset, bus::payload(frame), 1);
        if (offset != bus::EstStatus::kOffset) return;
        if (const auto status = bus::decode<bus::EstStatus>(bus::payload(frame))) valid = status->pos_valid;
      });
      if (!out.position || !out.motion || !out.deviation) continue;
      const auto wide = [](float x) { return static_cast<double>(x); };
      const double dx = bus::EstPos::kXScale * out.position->x_raw - now.truth.x_m;
      const double dy = bus::EstPos::kYScale * out.position->y_raw - now.truth.y_m;
      off_m = std::hypot(dx, dy), off_rad = std::abs(wrap(wide(out.motion->yaw_rad) - now.truth.yaw_rad));
      if (!valid) continue;
      if (valid_m < 0) valid_m = now.way_m - epochs[from].way_m;
      worst = std::max({worst, std::abs(dx) / wide(out.deviation->std_x_m), std::abs(dy) / wide(out.deviation->std_y_m),
                        off_rad / wide(out.deviation->std_yaw_rad)});
    }
    std::printf("lab %2zu: valid %d since %.1f m, %.3f m, %.2f deg off, worst valid %.1f sigmas\n", place, valid,
                valid_m, off_m, off_rad * kDegree, worst);
    found += valid && off_m <= 0.15 && off_rad * kDegree <= 5 ? 1 : 0;
    beyond += worst > 3 ? 1 : 0;
  }
  std::printf("lab: %d of 20 within 0.15 m and 5 deg, %d ever valid beyond 3 sigma\n", found, beyond);
  EXPECT_GE(found, 18);
  EXPECT_EQ(beyond, 0);
}

}  // namespace
}  // namespace tetap::sim
