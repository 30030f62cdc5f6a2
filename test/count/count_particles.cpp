// SPDX-License-Identifier: Apache-2.0
// The particle filter's workload: 1000 particles, speed and yaw rate with noise, range and bearing to four landmarks,
// systematic resampling every step, weighted mean.
#include "board.hpp"
#include "markers.hpp"
#include "tetap/filter/particle.hpp"
#include "tetap/filter/particle_pose.hpp"

#include <array>

namespace {

using namespace tetap;
using count::opaque;
using count::Region;

constexpr std::size_t kParticles = 1000, kSteps = 6;
constexpr std::array<std::array<float, 2>, 4> kLandmarks{{{60, 20}, {60, -20}, {-30, 40}, {-30, -40}}};
using Sightings = std::array<filter::ParticleSighting, 4>;

void pf1000() {
  static std::array<Sightings, kSteps> sightings;
  static std::array<filter::ParticleArc, kSteps> motions;
  base::Random noise(1);
  filter::ParticlePose truth;
  for (std::size_t k = 0; k < kSteps; ++k) {
    const float rate_radps = 0.3F * base::cos(0.05F * static_cast<float>(k));
    motions[k] = {.ds_m = 0.1F, .dyaw_rad = 0.1F * rate_radps, .sigma_ds_m = 0.01F, .sigma_dyaw_rad = 0.005F};
    truth = motions[k].sample(truth, {0.0F, 0.0F});
    for (std::size_t m = 0; m < kLandmarks.size(); ++m) {
      const float dx = kLandmarks[m][0] - truth.x_m, dy = kLandmarks[m][1] - truth.y_m;
      sightings[k][m] = filter::ParticleSighting::at(
          kLandmarks[m][0], kLandmarks[m][1], base::sqrt(dx * dx + dy * dy) + 0.3F * noise.normal(),
          base::atan2(dy, dx) - truth.yaw_rad() + 0.03F * noise.normal(), 0.3F, 0.03F);
    }
  }
  static filter::Particles<filter::ParticlePose, kParticles> cloud({1, 2});
  cloud.fill(kParticles, [](const filter::Draw& draw) {
    return filter::ParticlePose::at(0.3F * draw.normal(0), 0.3F * draw.normal(1), 0.05F * draw.normal(2));
  });
  std::array<float, 3> mean{};
  for (std::size_t k = 0; k < kSteps; ++k) {
    const Region<struct w6_pf1000> region;
    {
      const Region<struct pf_predict> part;
      static_cast<void>(cloud.predict(motions[k]));
    }
    {
      const Region<struct pf_weigh> part;
      const Sightings& seen = sightings[k];
      cloud.weigh([&seen](const filter::ParticlePose& pose) {
        float d = 0.0F;
#pragma GCC unroll 4
        for (const filter::ParticleSighting& one : seen) d += one.distance(pose);
        return -0.5F * d;
      });
    }
    {
      const Region<struct pf_mean> part;
      const filter::ParticlePose pose = filter::mean_pose(cloud);
      mean = {pose.x_m, pose.y_m, pose.yaw_rad()};
    }
    {
      const Region<struct pf_resample> part;
      cloud.resample(filter::Resampling::kSystematic, kParticles);
    }
  }
  opaque(mean);
  opaque(cloud);
}

}  // namespace

int main() {
  static Board board;
  count::calibrate();
  pf1000();
  board.print("count: done\n");
  count::finish();
  return 0;
}
