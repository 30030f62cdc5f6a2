// SPDX-License-Identifier: Apache-2.0
// EKF-SLAM's workload: 30 landmarks, a circle of 10 m at 1 m/s, in each step a prediction and range and bearing to five
// landmarks whose identities are known.
#include "board.hpp"
#include "markers.hpp"
#include "tetap/base/random.hpp"
#include "tetap/slam/ekf_slam.hpp"

#include <array>

namespace {

using namespace tetap;
using count::opaque;
using count::Region;

constexpr int kLandmarks = 30, kSteps = 12, kSeen = 5;
using Slam = slam::EkfSlam<kLandmarks, kSeen>;
using Sightings = std::array<slam::Sighting, kSeen>;
using Pairs = std::array<Slam::Pair, kSeen>;

/// Landmarks lie in turn 3 m inside and outside of the circle around (0, 10).
slam::Sighting sighting_of(int landmark, const model::PlanarPose& pose, base::Random& noise) {
  const base::SinCos at = base::sincos(0.20943951F * static_cast<float>(landmark));
  const float radius_m = landmark % 2 == 0 ? 7.0F : 13.0F;
  const float dx = radius_m * at.cos - pose.x.minus({}), dy = 10.0F + radius_m * at.sin - pose.y.minus({});
  return {.id = static_cast<std::uint16_t>(landmark),
          .range_m = base::sqrt(dx * dx + dy * dy) + 0.1F * noise.normal(),
          .bearing_rad = base::wrap_angle(base::atan2(dy, dx) - pose.yaw_rad + 0.02F * noise.normal())};
}

void slam63() {
  static Slam slam;
  static std::array<Sightings, kSteps> sightings;
  static std::array<Pairs, kSteps> pairs;
  constexpr model::PlanarIncrement kStep{.ds_m = 0.1F, .dyaw_rad = 0.01F, .var_ds = 1e-4F, .var_dyaw = 1e-5F};
  base::Random noise(1);
  model::PlanarPose truth;
  slam.options.gate = 1e6F;
  slam.options.noise = {.sigma_range_m = 0.1F, .sigma_bearing_rad = 0.02F};
  slam.start(truth, filter::Symmetric<float, 3>::diagonal({1e-4F, 1e-4F, 1e-4F}));
  for (int k = 0; k < kLandmarks; ++k)
    static_cast<void>(slam.add(sighting_of(k, truth, noise), static_cast<std::uint16_t>(k), 0));
  for (std::size_t k = 0; k < kSteps; ++k) {
    truth = kStep.predict(truth);
    for (std::size_t i = 0; i < kSeen; ++i) {
      const int landmark = static_cast<int>(kSeen * k + i) % kLandmarks;
      sightings[k][i] = sighting_of(landmark, truth, noise);
      pairs[k][i] = {.sighting = static_cast<int>(i), .landmark = landmark};
    }
  }
  std::array<slam::SightingRecord, kSeen> records;
  for (std::size_t k = 0; k < kSteps; ++k) {
    const Region<struct w7_slam63> region;
    {
      const Region<struct slam_predict> part;
      static_cast<void>(slam.predict(kStep));
    }
    {
      const Region<struct slam_fuse> part;
      slam.fuse(sightings[k], pairs[k], 0, records);
    }
  }
  opaque(records);
  opaque(slam);
}

}  // namespace

int main() {
  static Board board;
  count::calibrate();
  slam63();
  board.print("count: done\n");
  count::finish();
  return 0;
}
