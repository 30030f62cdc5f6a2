// SPDX-License-Identifier: Apache-2.0
// Monte Carlo localisation among known landmarks (Dellaert, Fox, Burgard, Thrun 1999). Likelihoods are tempered,
// resampling is regularised, and KLD sets the number of particles. Poses are injected from a sighting while the track
// is lost (Thrun, Burgard, Fox 2005, sec. 8.3.5). A threshold on the mean likelihood replaces the ratio there.
#pragma once

#include "tetap/filter/particle.hpp"
#include "tetap/filter/particle_number.hpp"
#include "tetap/filter/particle_pose.hpp"

#include <cstddef>
#include <cstdint>
#include <span>

namespace tetap::filter {

struct ParticleLandmark {
  float x_m = 0;
  float y_m = 0;
};

/// A range and bearing to the landmark of this index, or to any where the identity is withheld.
struct LandmarkSeen {
  static constexpr std::int32_t kAny = -1;
  std::int32_t landmark = kAny;
  float range_m = 0;
  float bearing_rad = 0;
  float sigma_range_m = 0;
  float sigma_bearing_rad = 0;

  [[nodiscard]] constexpr bool valid(std::size_t landmarks) const {
    const bool known =
        landmark == kAny ? landmarks > 0 : landmark >= 0 && static_cast<std::size_t>(landmark) < landmarks;
    return known && range_m >= 0.0F && range_m < 1e4F && base::abs(bearing_rad) < 1e3F && sigma_range_m > 1e-4F &&
           sigma_range_m < 1e3F && sigma_bearing_rad > 1e-4F && sigma_bearing_rad < 1e2F;
  }
};

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
class ParticleLocalisation {
 public:
  using Cloud = Particles<ParticlePose, kMost>;

  LocalisationOptions options;
  Cloud cloud;

  constexpr ParticleLocalisation() = default;
  constexpr explicit ParticleLocalisation(base::PhiloxKey key) : cloud(key) {}

  /// A normal distribution about a pose.
  constexpr void start(std::size_t count, const ParticlePose& pose, float sigma_m, float sigma_yaw_rad) {
    const float yaw = pose.yaw_rad();
    cloud.fill(count, [&](const Draw& draw) {
      return ParticlePose::at(pose.x_m + sigma_m * draw.normal(0), pose.y_m + sigma_m * draw.normal(1),
                              yaw + sigma_yaw_rad * draw.normal(2));
    });
    likelihood_ = 0.5F * (options.lost_below + options.found_above);  // a start has yet to be confirmed
    lost_ = false;
  }
  /// Uniform over a rectangle and all headings.
  constexpr void start_anywhere(std::size_t count, ParticleLandmark low, ParticleLandmark high) {
    cloud.fill(count, [&](const Draw& draw) {
      return ParticlePose::at(low.x_m + (high.x_m - low.x_m) * draw.uniform(0),
                              low.y_m + (high.y_m - low.y_m) * draw.uniform(1), kTwoPi * draw.uniform(2));
    });
    likelihood_ = 0.0F;
    lost_ = true;
  }

  constexpr bool predict(const ParticleArc& motion) { return cloud.predict(motion); }

  /// All sightings of one moment. False, and nothing has changed, when there is none or one is not valid.
  bool update(std::span<const LandmarkSeen> seen, std::span<const ParticleLandmark> map) {
    if (seen.empty()) return false;
    for (const LandmarkSeen& one : seen)
      if (!one.valid(map.size())) return false;
    float evidence = 0.0F;
    for (const LandmarkSeen& one : seen) evidence += weigh(one, map);
    const float mean = base::exp(evidence / static_cast<float>(static_cast<std::int32_t>(seen.size())));
    likelihood_ += (lost_ ? options.search_gain : options.injection_gain) * (mean - likelihood_);
    lost_ = likelihood_ < (lost_ ? options.found_above : options.lost_below);
    if (lost_) {
      resample(kMost);
      inject(seen, map);
    } else if (cloud.effective() <
               options.resample_below * static_cast<float>(static_cast<std::int32_t>(cloud.size()))) {
      resample(wanted());
    }
    return true;
  }

  /// No single track: poses are injected.
  [[nodiscard]] constexpr bool lost() const { return lost_; }
  /// Low-passed mean likelihood of a sighting, 0 to 1.
  [[nodiscard]] constexpr float likelihood() const { return likelihood_; }

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

 private:
  static constexpr float kTwoPi = 6.28318531F;
  static constexpr std::size_t kCandidates = 24;

  [[nodiscard]] static constexpr bool near(const ParticlePose& a, const ParticlePose& b, float radius2_m2) {
    const float dx = a.x_m - b.x_m, dy = a.y_m - b.y_m;
    return dx * dx + dy * dy < radius2_m2 && a.cos_yaw * b.cos_yaw + a.sin_yaw * b.sin_yaw > 0.70710678F;
  }
  constexpr float weigh(const LandmarkSeen& one, std::span<const ParticleLandmark> map) {
    const std::size_t first = one.landmark < 0 ? 0 : static_cast<std::size_t>(one.landmark);
    const std::span<const ParticleLandmark> candidates = map.subspan(first, one.landmark < 0 ? map.size() : 1);
    const auto sighting =
        ParticleSighting::at(0.0F, 0.0F, one.range_m, one.bearing_rad, one.sigma_range_m, one.sigma_bearing_rad);
    const float scale = -0.5F * options.temper;
    return cloud.weigh([&](const ParticlePose& pose) {
      float least = options.cap;
      for (const ParticleLandmark& landmark : candidates) {
        const float d = sighting.distance(pose, landmark.x_m, landmark.y_m);
        least = d < least ? d : least;
      }
      return scale * least;
    });
  }
  void resample(std::size_t count) {
    const auto all = [](const ParticlePose&) { return true; };
    const auto kernel = ParticleKernel::of(pose_covariance(cloud, mean_pose(cloud), all), options.bandwidth);
    cloud.resample(Resampling::kSystematic, count);
    if (!lost_) static_cast<void>(cloud.predict(kernel));  // many modes have no common width
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
  [[nodiscard]] static constexpr std::int32_t whole(float v) {
    const float bounded = base::clamp(v, -1e9F, 1e9F);
    const auto towards_zero = static_cast<std::int32_t>(bounded);
    return towards_zero - (bounded < static_cast<float>(towards_zero) ? 1 : 0);
  }
  /// Poses from which one of the sightings looks as it does, on a circle about its landmark.
  constexpr void inject(std::span<const LandmarkSeen> seen, std::span<const ParticleLandmark> map) {
    const auto pick = [](std::uint32_t word, std::size_t count) {
      return static_cast<std::size_t>((std::uint64_t{word} * count) >> 32);
    };
    static_cast<void>(cloud.inject(options.inject_share, [&](const Draw& draw) {
      const LandmarkSeen& one = seen[pick(draw.words[0], seen.size())];
      const std::uint32_t mixed = draw.words[0] * 0x9E37'79B9U ^ draw.words[1];
      const ParticleLandmark& landmark =
          map[one.landmark < 0 ? pick(mixed, map.size()) : static_cast<std::size_t>(one.landmark)];
      const float direction = kTwoPi * draw.uniform(2);
      const base::SinCos look = base::sincos(direction);
      const float range = one.range_m + one.sigma_range_m * draw.normal(0);
      return ParticlePose::at(landmark.x_m - range * look.cos, landmark.y_m - range * look.sin,
                              direction - one.bearing_rad + one.sigma_bearing_rad * draw.normal(1));
    }));
  }

  float likelihood_ = 1.0F;
  bool lost_ = false;
};

}  // namespace tetap::filter
