// SPDX-License-Identifier: Apache-2.0
// Particles of a planar pose: where they begin, how many they are, how they are resampled, and the pose that they stand
// for. Resampling is regularised, and KLD sets the number of particles.
#pragma once

#include "tetap/filter/particle.hpp"
#include "tetap/filter/particle_number.hpp"
#include "tetap/filter/particle_pose.hpp"

#include <cstddef>
#include <cstdint>

namespace tetap::filter {

struct LocalisationOptions {
  float temper = 0.35F;         ///< power of the likelihood: errors of one landmark's sightings are not independent
  float cap = 13.8F;            ///< largest squared distance of a sighting: an outlier decides no more than that
  float resample_below = 0.5F;  ///< effective share of the particles
  float bandwidth = 0.3F;       ///< kernel after resampling, in standard deviations
  float lost_below = 0.3F;      ///< mean likelihood of a sighting, its largest being 1: the search begins
  float found_above = 0.5F;     ///< the search ends
  float injection_gain = 0.1F;  ///< low-pass on the mean likelihood, per batch, while there is a track
  float search_gain = 0.2F;     ///< the same while there is none
  float inject_share = 0.2F;    ///< particles replaced at each batch while lost
  float kld_error = 0.05F;      ///< Kullback-Leibler distance
  float kld_quantile = 2.326F;  ///< normal quantile of the probability 0.99
  std::size_t least = 500;      ///< particles
};

template <std::size_t kMost>
class PoseCloud {
 public:
  using Cloud = Particles<ParticlePose, kMost>;

  LocalisationOptions options;
  Cloud cloud;

  constexpr PoseCloud() = default;
  constexpr explicit PoseCloud(base::PhiloxKey key) : cloud(key) {}

  /// A normal distribution about a pose.
  constexpr void start(std::size_t count, const ParticlePose& pose, float sigma_m, float sigma_yaw_rad) {
    const float yaw = pose.yaw_rad();
    cloud.fill(count, [&](const Draw& draw) {
      return ParticlePose::at(pose.x_m + sigma_m * draw.normal(0), pose.y_m + sigma_m * draw.normal(1),
                              yaw + sigma_yaw_rad * draw.normal(2));
    });
  }

  struct Estimate {
    ParticlePose pose;
    Symmetric<float, 3> p;  ///< x, y, yaw
    float share = 0;        ///< share of the weight that lies in the mode's neighbourhood
  };
  /// Mean and covariance of the mode's neighbourhood: half a metre and an eighth of a turn for the mode, then 0.7 m.
  [[nodiscard]] Estimate estimate() const {
    const std::size_t best =
        cloud.mode(kCandidates, [](const ParticlePose& a, const ParticlePose& b) { return near(a, b, 0.5F * 0.5F); });
    const ParticlePose centre = cloud[best];
    const auto around = [&centre](const ParticlePose& p) { return near(centre, p, 0.7F * 0.7F); };
    Estimate result{.pose = mean_pose(cloud, around)};
    result.p = pose_covariance(cloud, result.pose, around);
    for (std::size_t i = 0; i < cloud.size(); ++i) result.share += around(cloud[i]) ? cloud.weight(i) : 0.0F;
    return result;
  }

  /// `regular`: with a kernel of the cloud's own width; many modes have no common one.
  void resample(std::size_t count, bool regular) {
    const auto all = [](const ParticlePose&) { return true; };
    const auto kernel = ParticleKernel::of(pose_covariance(cloud, mean_pose(cloud), all), options.bandwidth);
    cloud.resample(Resampling::kSystematic, count);
    if (regular) static_cast<void>(cloud.predict(kernel));
  }
  /// Bins of half a metre and 15 degrees that hold weight.
  [[nodiscard]] std::size_t wanted() const {
    BinSet<2048> bins;
    for (std::size_t i = 0; i < cloud.size(); ++i) {
      if (cloud.weight(i) * static_cast<float>(static_cast<std::int32_t>(cloud.size())) < 0.1F) continue;
      const ParticlePose& p = cloud[i];
      bins.add(bins.bin(whole(p.x_m * 2.0F), whole(p.y_m * 2.0F), whole(p.yaw_rad() * (24.0F / kTwoPi))));
    }
    const std::size_t least = options.least < kMost ? options.least : kMost;
    return particles_for(bins.count(), options.kld_error, options.kld_quantile, least, kMost);
  }

 protected:
  static constexpr float kTwoPi = 6.28318531F;
  static constexpr std::size_t kCandidates = 24;

  [[nodiscard]] static constexpr bool near(const ParticlePose& a, const ParticlePose& b, float radius2_m2) {
    const float dx = a.x_m - b.x_m, dy = a.y_m - b.y_m;
    return dx * dx + dy * dy < radius2_m2 && a.cos_yaw * b.cos_yaw + a.sin_yaw * b.sin_yaw > 0.70710678F;
  }
  [[nodiscard]] static constexpr std::int32_t whole(float v) {
    const float bounded = base::clamp(v, -1e9F, 1e9F);
    const auto towards_zero = static_cast<std::int32_t>(bounded);
    return towards_zero - (bounded < static_cast<float>(towards_zero) ? 1 : 0);
  }
};

}  // namespace tetap::filter
