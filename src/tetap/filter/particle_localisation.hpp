// SPDX-License-Identifier: Apache-2.0
// Monte Carlo localisation among known landmarks (Dellaert, Fox, Burgard, Thrun 1999). Likelihoods are tempered,
// resampling is regularised, and KLD sets the number of particles. Poses are injected from a sighting while the track
// is lost (Thrun, Burgard, Fox 2005, sec. 8.3.5). A threshold on the mean likelihood replaces the ratio there.
#pragma once

#include "tetap/filter/pose_cloud.hpp"

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

template <std::size_t kMost>
class ParticleLocalisation : public PoseCloud<kMost> {
  using Base = PoseCloud<kMost>;
  using Base::kTwoPi;

 public:
  using Base::cloud;
  using Base::options;

  constexpr ParticleLocalisation() = default;
  constexpr explicit ParticleLocalisation(base::PhiloxKey key) : Base(key) {}

  /// A normal distribution about a pose.
  constexpr void start(std::size_t count, const ParticlePose& pose, float sigma_m, float sigma_yaw_rad) {
    Base::start(count, pose, sigma_m, sigma_yaw_rad);
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
      Base::resample(kMost, false);
      inject(seen, map);
    } else if (cloud.effective() <
               options.resample_below * static_cast<float>(static_cast<std::int32_t>(cloud.size()))) {
      Base::resample(Base::wanted(), true);
    }
    return true;
  }

  /// No single track: poses are injected.
  [[nodiscard]] constexpr bool lost() const { return lost_; }
  /// Low-passed mean likelihood of a sighting, 0 to 1.
  [[nodiscard]] constexpr float likelihood() const { return likelihood_; }

 private:
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
