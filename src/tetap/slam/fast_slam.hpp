// SPDX-License-Identifier: Apache-2.0
// FastSLAM of fixed capacity: particles of a planar pose, each with landmarks of its own (Montemerlo, Thrun, Koller,
// Wegbreit, AAAI 2002, version 1, and IJCAI 2003, version 2). The motion since the last sighting is one displacement in
// the robot's frame, the same for all particles. A prediction costs what it costs for one. The filter is not
// consistent; docs/explanation/fast_slam.md has the equations and by how much.
#pragma once

#include "tetap/filter/particle_noise.hpp"
#include "tetap/filter/resampling.hpp"
#include "tetap/filter/symmetric.hpp"
#include "tetap/model/planar_increment.hpp"
#include "tetap/slam/fast_slam_particle.hpp"
#include "tetap/slam/sighting.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace tetap::slam {

struct FastSlamOptions {
  SightingNoise noise;
  float gate = 13.816F;         ///< NIS beyond which a particle takes a sighting for an outlier: chi-square, 99.9 %
  float resample_below = 0.5F;  ///< share of effective particles
  float correlation_m = 0;      ///< path over which errors of one landmark's sightings stay alike; 0: none
};

struct FastSlamCounts {
  std::uint32_t fused = 0, no_room = 0, invalid = 0, resampled = 0, copied = 0;
};

template <int kParticles_, int kLandmarks_, int kVersion_ = 2>
class FastSlam {
 public:
  static constexpr int kParticles = kParticles_, kLandmarks = kLandmarks_, kVersion = kVersion_;
  static_assert(kVersion == 1 || kVersion == 2);
  static_assert(kParticles >= 2 && kParticles <= 32'768 && kLandmarks >= 1 && kLandmarks < 0xffff);
  static constexpr int kNone = -1;
  using Particle = FastSlamParticle<kLandmarks>;

  struct Estimate {
    PlanarOffset pose;              ///< from the origin that the owner holds
    filter::Symmetric<float, 3> p;  ///< spread of the particles plus the motion since the last sighting
  };

  FastSlamOptions options;

  FastSlam() = default;
  explicit FastSlam(base::PhiloxKey key) : key_(key) {}

  [[nodiscard]] const FastSlamCounts& counts() const { return counts_; }
  [[nodiscard]] int landmarks() const { return landmarks_; }
  [[nodiscard]] std::uint16_t id(int landmark) const { return ids_[at(landmark)]; }
  [[nodiscard]] const Particle& best() const {
    std::size_t best = 0;
    for (std::size_t i = 1; i < particles_.size(); ++i)
      if (log_weights_[i] > log_weights_[best]) best = i;
    return particles_[best];
  }

  /// Begins anew at a pose with independent errors, without landmarks.
  void start(const PlanarOffset& pose, float sigma_position_m, float sigma_yaw_rad) {
    ++epoch_;
    reset_map();
    motion_ = {};
    for (std::size_t i = 0; i < particles_.size(); ++i)
      particles_[i].pose = drawn(i, pose, sigma_position_m, sigma_yaw_rad);
    log_weights_.fill(0.0F);
  }
  void reset_map() { landmarks_ = 0; }
  /// Key of the draws from here on.
  void set_key(base::PhiloxKey key) { key_ = key; }
  /// Robot and map move as one: each particle's landmarks keep their places beside its robot, which gets a pose drawn
  /// from the one given.
  void set_pose(const PlanarOffset& pose, float sigma_position_m, float sigma_yaw_rad);

  /// Adds to the motion that the particles have not made yet. False, and nothing has changed, when the increment is no
  /// number.
  bool predict(const model::PlanarIncrement& increment) {
    if (!motion_.add(increment)) return false;
    path_.move(increment.ds_m, increment.dyaw_rad);
    return true;
  }

  /// Fuses sightings of one stamp, each with range, bearing and identity. The number of those that were used.
  int update(std::span<const Sighting> seen) {
    ++epoch_;
    std::array<Use, kMostSightings> uses;
    std::size_t count = 0;
    const int landmarks_before = landmarks_;
    for (const Sighting& one : seen) {
      if (!one.valid() || one.components() != 2 || one.id == Sighting::kNoId || count == uses.size()) {
        ++counts_.invalid;
        continue;
      }
      const int known = find(one.id);
      if (known == kNone && landmarks_ == kLandmarks) {
        ++counts_.no_room;
        continue;
      }
      uses[count++] = {.seen = one,
                       .landmark = known == kNone ? landmarks_ : known,
                       .is_new = known == kNone,
                       .known = known != kNone && known < landmarks_before,
                       .noise = options.noise};
      if (known != kNone)
        uses[count - 1].noise = options.noise.scaled(path_.repetition(seen_path_um_[at(known)], options.correlation_m));
      seen_path_um_[at(uses[count - 1].landmark)] = path_.um();
      if (known == kNone) ids_[at(landmarks_++)] = one.id;
    }
    const std::span<const Use> used{uses.data(), count};
    for (std::size_t i = 0; i < particles_.size(); ++i) move_and_weigh(i, used);
    motion_ = {};
    counts_.fused += static_cast<std::uint32_t>(count);
    normalise();
    resample();
    return static_cast<int>(count);
  }

  [[nodiscard]] Estimate estimate() const;
  /// Landmark k over all particles: mean, and spread plus the particles' own covariance. Relative to the zero of poses.
  [[nodiscard]] FastSlamLandmark landmark(int k) const;

  /// Words of memory in use, and one of them: log-weight, pose and landmarks of each particle.
  [[nodiscard]] std::size_t words() const { return kCount * words_of_particle(); }
  [[nodiscard]] float word(std::size_t i) const {
    const Particle& particle = particles_[i / words_of_particle()];
    const std::size_t within = i % words_of_particle();
    const PlanarOffset& s = particle.pose;
    if (within < 4) return std::array{log_weights_[i / words_of_particle()], s.x_m, s.y_m, s.yaw_rad}[within];
    const FastSlamLandmark& m = particle.landmarks[(within - 4) / 5];
    return std::array{m.x_m, m.y_m, m.p.xx, m.p.xy, m.p.yy}[(within - 4) % 5];
  }

 private:
  [[nodiscard]] std::size_t words_of_particle() const { return 4 + 5 * static_cast<std::size_t>(landmarks_); }
  /// A pose with independent errors, for particle i in this epoch.
  [[nodiscard]] PlanarOffset drawn(std::size_t i, const PlanarOffset& pose, float sigma_position_m,
                                   float sigma_yaw_rad) const {
    const filter::Draw draw = filter::draw_of(key_, epoch_, static_cast<std::uint32_t>(i), filter::DrawFor::kStart);
    return {.x_m = pose.x_m + sigma_position_m * draw.normal(0),
            .y_m = pose.y_m + sigma_position_m * draw.normal(1),
            .yaw_rad = base::wrap_angle(pose.yaw_rad + sigma_yaw_rad * draw.normal(2))};
  }
  static constexpr std::size_t kMostSightings = 16;
  static constexpr auto kCount = static_cast<std::size_t>(kParticles);
  static constexpr std::size_t at(int i) { return static_cast<std::size_t>(i); }
  struct Use {
    Sighting seen;
    int landmark = 0;
    bool is_new = false;  ///< the landmark begins with this sighting
    bool known = false;   ///< the landmark was there before this stamp
    SightingNoise noise;
  };

  [[nodiscard]] int find(std::uint16_t id) const {
    for (int k = 0; k < landmarks_; ++k)
      if (ids_[at(k)] == id) return k;
    return kNone;
  }

  /// One particle over all sightings of a stamp. Implements docs/explanation/fast_slam.md (5).
  void move_and_weigh(std::size_t i, std::span<const Use> uses) {
    Particle& particle = particles_[i];
    PosePosterior posterior = motion_.from(particle.pose);
    float log_weight = 0.0F;
    if constexpr (kVersion == 2)
      for (const Use& use : uses)
        if (use.known)
          log_weight += posterior.refine(use.seen, particle.landmarks[at(use.landmark)], use.noise, options.gate);
    particle.pose = posterior.sample(filter::normals_of<3>(key_, epoch_, static_cast<std::uint32_t>(i)));
    for (const Use& use : uses) {
      FastSlamLandmark& landmark = particle.landmarks[at(use.landmark)];
      if (use.is_new) {
        landmark = FastSlamLandmark::seen_from(particle.pose, use.seen, use.noise);
      } else {
        const float log_likelihood = landmark.update(particle.pose, use.seen, use.noise, options.gate);
        if constexpr (kVersion == 1) log_weight += log_likelihood;
      }
    }
    log_weights_[i] += log_weight;
  }

  /// Brings the largest log-weight to zero; what is no number counts as the least.
  void normalise() {
    constexpr float kLeast = -1e4F;
    float largest = 2.0F * kLeast;
    for (float& w : log_weights_) {
      if (!(w > kLeast)) w = kLeast;
      largest = w > largest ? w : largest;
    }
    if (!(largest < 1e30F)) largest = 0.0F;
    for (float& w : log_weights_) w = w - largest > kLeast ? w - largest : kLeast;
  }

  /// Implements docs/explanation/fast_slam.md (7).
  void resample() {
    constexpr int kBits = filter::weight_bits(kCount);
    std::array<std::uint32_t, kCount> weights;
    std::uint64_t squares = 0;
    std::uint32_t sum = 0;
    for (std::size_t i = 0; i < kCount; ++i) {
      const float scaled = base::exp(log_weights_[i]) * static_cast<float>(std::int32_t{1} << kBits) + 0.5F;
      weights[i] = static_cast<std::uint32_t>(static_cast<std::int32_t>(scaled));
      sum += weights[i];
      squares += std::uint64_t{weights[i]} * weights[i];
    }
    const std::uint64_t share = static_cast<std::uint64_t>(options.resample_below * 1024.0F);
    // sum^2 / squares < share kCount / 1024, without rounding
    constexpr int kShift = kBits > 16 ? kBits - 16 : 0;
    const std::uint64_t root = sum >> kShift;
    if (root * root >= ((squares >> (2 * kShift)) * share * kCount) >> 10) return;
    std::array<std::uint16_t, kCount> copies;
    base::Random random(std::uint64_t{key_[1]} << 32 | key_[0],
                        std::uint64_t{static_cast<std::uint32_t>(filter::DrawFor::kResampling)} << 32 | epoch_);
    filter::count_copies(filter::Resampling::kSystematic, weights, sum, static_cast<std::uint32_t>(kCount), random,
                         copies);
    for (const std::uint16_t c : copies) counts_.copied += c > 1 ? c - 1U : 0U;
    filter::place_copies<Particle>(particles_, copies, kCount);
    log_weights_.fill(0.0F);
    ++counts_.resampled;
  }

  std::array<Particle, kCount> particles_{};
  std::array<float, kCount> log_weights_{};
  std::array<std::uint16_t, static_cast<std::size_t>(kLandmarks)> ids_{};
  std::array<std::int64_t, static_cast<std::size_t>(kLandmarks)> seen_path_um_{};
  int landmarks_ = 0;
  ViewPath path_;
  SharedMotion motion_;
  FastSlamCounts counts_;
  std::uint32_t epoch_ = 0;
  base::PhiloxKey key_{};
};

/// Implements docs/explanation/fast_slam.md (8).
template <int kParticles_, int kLandmarks_, int kVersion_>
typename FastSlam<kParticles_, kLandmarks_, kVersion_>::Estimate
FastSlam<kParticles_, kLandmarks_, kVersion_>::estimate() const {
  const PlanarOffset from = motion_.from(particles_[0].pose).mean;
  float sum = 0.0F, x = 0.0F, y = 0.0F, c = 0.0F, s = 0.0F;
  for (std::size_t i = 0; i < kCount; ++i) {
    const PlanarOffset pose = motion_.from(particles_[i].pose).mean;
    const float w = base::exp(log_weights_[i]);
    const base::SinCos heading = base::sincos(pose.yaw_rad - from.yaw_rad);
    sum += w;
    x += w * (pose.x_m - from.x_m);
    y += w * (pose.y_m - from.y_m);
    c += w * heading.cos;
    s += w * heading.sin;
  }
  Estimate estimate;
  estimate.pose = {.x_m = from.x_m + x / sum,
                   .y_m = from.y_m + y / sum,
                   .yaw_rad = base::wrap_angle(from.yaw_rad + base::atan2(s, c))};
  for (std::size_t i = 0; i < kCount; ++i) {
    const PosePosterior posterior = motion_.from(particles_[i].pose);
    const float w = base::exp(log_weights_[i]) / sum;
    const std::array<float, 3> e{posterior.mean.x_m - estimate.pose.x_m, posterior.mean.y_m - estimate.pose.y_m,
                                 base::wrap_angle(posterior.mean.yaw_rad - estimate.pose.yaw_rad)};
    for (int column = 0; column < 3; ++column)
      for (int row = 0; row <= column; ++row)
        estimate.p(row, column) += w * (e[at(row)] * e[at(column)] + posterior.p(row, column));
  }
  return estimate;
}

template <int kParticles_, int kLandmarks_, int kVersion_>
void FastSlam<kParticles_, kLandmarks_, kVersion_>::set_pose(const PlanarOffset& pose, float sigma_position_m,
                                                             float sigma_yaw_rad) {
  ++epoch_;
  for (std::size_t i = 0; i < kCount; ++i) {
    Particle& particle = particles_[i];
    const PlanarOffset from =
        motion_.from(particle.pose).sample(filter::normals_of<3>(key_, epoch_, static_cast<std::uint32_t>(i)));
    const PlanarOffset to = drawn(i, pose, sigma_position_m, sigma_yaw_rad);
    const base::SinCos turn = base::sincos(to.yaw_rad - from.yaw_rad);
    const float c = turn.cos, s = turn.sin;
    particle.pose = to;
    for (int k = 0; k < landmarks_; ++k) {
      FastSlamLandmark& m = particle.landmarks[at(k)];
      const float dx = m.x_m - from.x_m, dy = m.y_m - from.y_m;
      const Covariance2 p = m.p;
      m = {.x_m = to.x_m + c * dx - s * dy,
           .y_m = to.y_m + s * dx + c * dy,
           .p = {.xx = c * c * p.xx - 2.0F * c * s * p.xy + s * s * p.yy,
                 .xy = c * s * (p.xx - p.yy) + (c * c - s * s) * p.xy,
                 .yy = s * s * p.xx + 2.0F * c * s * p.xy + c * c * p.yy}};
    }
  }
  motion_ = {};
}

template <int kParticles_, int kLandmarks_, int kVersion_>
FastSlamLandmark FastSlam<kParticles_, kLandmarks_, kVersion_>::landmark(int k) const {
  const FastSlamLandmark& first = particles_[0].landmarks[at(k)];
  float sum = 0.0F, x = 0.0F, y = 0.0F;
  Covariance2 p;
  for (std::size_t i = 0; i < kCount; ++i) {
    const FastSlamLandmark& m = particles_[i].landmarks[at(k)];
    const float w = base::exp(log_weights_[i]), dx = m.x_m - first.x_m, dy = m.y_m - first.y_m;
    sum += w;
    x += w * dx;
    y += w * dy;
    p.xx += w * (m.p.xx + dx * dx);
    p.xy += w * (m.p.xy + dx * dy);
    p.yy += w * (m.p.yy + dy * dy);
  }
  x /= sum;
  y /= sum;
  const auto variance = [&](float square, float mean2) { return base::max(square / sum - mean2, 0.0F); };
  return {.x_m = first.x_m + x,
          .y_m = first.y_m + y,
          .p = {.xx = variance(p.xx, x * x), .xy = p.xy / sum - x * y, .yy = variance(p.yy, y * y)}};
}

}  // namespace tetap::slam
