// SPDX-License-Identifier: Apache-2.0
// The visual window's workload: a camera drives ahead at 8 m/s between points on both sides, 20 features an image, a
// tenth of a second apart. A full track is one that all six images of the window saw. The same way again with a map:
// each point is recognised, and the map of 64 becomes full.
#include "board.hpp"
#include "markers.hpp"
#include "tetap/base/random.hpp"
#include "tetap/slam/speed_core.hpp"
#include "tetap/slam/visual_map.hpp"

#include <array>
#include <cstdint>

namespace {

using namespace tetap;
using count::opaque;
using count::Region;

constexpr int kImages = 16, kImagesOfMap = 96, kPoints = 20;
constexpr float kStep_m = 0.8F, kNearest_m = 4.0F, kFocal_px = 700.0F, kU_px = 600.0F, kV_px = 200.0F;
using Window = slam::VisualWindow<slam::SpeedCore, 6, 40>;
using Map = slam::VisualMap<slam::SpeedCore, 6, 40, 64>;
using Image = std::array<slam::ImageFeature, kPoints>;

struct Point {
  float ahead_m = 0, right_m = 0, down_m = 0;
  std::uint16_t id = 0;
};

/// Points that the camera has passed give way to new ones ahead of it.
void see(std::array<Point, kPoints>& points, float at_m, std::uint16_t& next_id, base::Random& noise, Image& image) {
  const auto quarters = [&](float px) { return static_cast<std::uint16_t>(4.0F * (px + noise.normal()) + 0.5F); };
  for (std::size_t i = 0; i < points.size(); ++i) {
    Point& point = points[i];
    if (point.id == 0 || point.ahead_m - at_m < kNearest_m) {
      const float ahead_m = 8.0F + 25.0F * noise.uniform(), side = i % 2 == 0 ? 0.3F : -0.3F;
      point = {.ahead_m = at_m + ahead_m,
               .right_m = side * (ahead_m - kNearest_m),
               .down_m = 0.1F * (ahead_m - kNearest_m) * (noise.uniform() - 0.5F),
               .id = next_id++};
    }
    const float depth_m = point.ahead_m - at_m;
    image[i] = {.id = point.id,
                .u_quarter_px = quarters(kU_px + kFocal_px * point.right_m / depth_m),
                .v_quarter_px = quarters(kV_px + kFocal_px * point.down_m / depth_m)};
  }
}

slam::VisualOptions options() {
  return {.camera = {.fu_px = kFocal_px, .fv_px = kFocal_px, .cu_px = kU_px, .cv_px = kV_px},
          .mounting = {.q_cb = {0.5F, 0.5F, -0.5F, 0.5F}, .lever_b_m = {1.0F, 0.0F, 0.5F}}};
}

/// Eight sightings and two new tracks, and the two tracks of the camera's own image: with a full map.
void visual_map() {
  static Map map(options());
  std::array<Point, kPoints> points{};
  std::uint16_t next_id = 1;
  base::Random noise(1);
  map.start(nav::Quaternion{}, 1e-3F, std::array<std::int64_t, 3>{}, 1e-3F);
  for (int k = 0; k < kImagesOfMap; ++k) {
    static Image image;
    see(points, kStep_m * static_cast<float>(k), next_id, noise, image);
    const bool full = map.map().size() == Map::kPoints;
    static_cast<void>(map.predict({.speed_b_mps = {10.0F * kStep_m, 0.0F, 0.0F}, .dt_s = 0.1F}));
    static_cast<void>(map.begin_image(image));
    while (map.busy()) {
      const auto track = [] {
        for (const int done = map.concluded(); map.busy() && map.concluded() == done;) map.work(1);
      };
      if (!full) {
        track();
        continue;
      }
      const Region<struct visual_map_track> counted;
      track();
    }
    static_cast<void>(map.end_image(image));
    static_cast<void>(map.begin_recognised(image));
    const auto recognise = [] {
      while (map.busy()) map.work(1);
    };
    if (full) {
      const Region<struct visual_map_recognised> counted;
      recognise();
    } else {
      recognise();
    }
    static_cast<void>(map.end_recognised(image));
  }
  opaque(map);
}

void visual_window() {
  static Window window(options());
  static std::array<Image, kImages> images;
  std::array<Point, kPoints> points{};
  std::uint16_t next_id = 1;
  base::Random noise(1);
  for (int k = 0; k < kImages; ++k)
    see(points, kStep_m * static_cast<float>(k), next_id, noise, images[static_cast<std::size_t>(k)]);
  window.start({}, 1e-3F, {}, 1e-3F);
  for (Image& image : images) {
    static_cast<void>(window.predict({.speed_b_mps = {10.0F * kStep_m, 0.0F, 0.0F}, .dt_s = 0.1F}));
    const Region<struct visual_image> whole;
    static_cast<void>(window.begin_image(image));
    while (window.busy()) {
      const Region<struct visual_track> track;
      for (const int done = window.concluded(); window.busy() && window.concluded() == done;) window.work(1);
    }
    static_cast<void>(window.end_image(image));
  }
  opaque(window);
}

}  // namespace

int main() {
  static Board board;
  count::calibrate();
  visual_window();
  visual_map();
  board.print("count: done\n");
  count::finish();
  return 0;
}
