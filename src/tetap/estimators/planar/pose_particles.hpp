// SPDX-License-Identifier: Apache-2.0
// The planar pose by particles: Monte Carlo localisation among the landmarks of a map, with or without their
// identities. The estimator finds the robot again after a wrong start, and from no start at all.
//
// Delayed: the cloud is at the far end of the window, where sightings reach it in their order. After every batch of
// sightings of one stamp the mode's neighbourhood gives pose and covariance. Dead reckoning carries both to the
// present. A tick without a sighting costs what dead reckoning costs.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/base/state_digest.hpp"
#include "tetap/estimators/context.hpp"
#include "tetap/estimators/planar/dead_reckoning.hpp"
#include "tetap/estimators/planar/landmark_sighting.hpp"
#include "tetap/estimators/planar/summing_ekf.hpp"
#include "tetap/filter/particle_localisation.hpp"
#include "tetap/sensor/window.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace tetap::estimators {

/// kMost: capacity of the cloud. A batch holds at most kBatch sightings; those beyond are counted as not used.
template <std::size_t kMost>
class PoseParticles {
  using Motion = PlanarDeadReckoning<SummingEkf>;

 public:
  static constexpr sensor::EstimatorKind kKind = sensor::EstimatorKind::kParticle;
  static constexpr bool kDelayed = true;
  static constexpr bool kUsesMap = true;
  static constexpr std::size_t kBatch = 16;
  /// Particles whose bits enter the digest in one tick.
  static constexpr std::size_t kScanned = 16;

  void restart(base::Micros t, const Context& ctx);
  void set_pose(base::Micros t, const SetPose& given, const Context& ctx);
  void advance(base::Micros t, const Context& ctx, const sensor::Window& window);

  template <class Input>
  requires requires(Motion& motion, const Input& input, const param::Parameters& n) {
    motion.fuse(input, base::Micros{}, n);
  }
  Innovation fuse(const Input& input, base::Micros stamp, const Context& ctx) {
    close_batch(stamp, ctx);
    const sensor::Verdict verdict = motion_.fuse(input, stamp, ctx.parameters);
    if (stamp - moved_ >= kLongestArc) move_cloud(stamp, ctx);
    return input_record(verdict);
  }
  /// Range and bearing together; the landmark 0xFF is one without an identity. A sighting whose distance from the
  /// estimate exceeds the cap of the likelihood counts as rejected: it weighs no more than the cap.
  Innovation fuse(const sensor::LandmarkSighting& sighting, base::Micros stamp, const Context& ctx);

  [[nodiscard]] Estimate estimate(const Context& ctx) const {
    Estimate estimate = present_.estimate(ctx.parameters);
    estimate.position_valid = estimate.heading_valid = tracking();
    return estimate;
  }
  [[nodiscard]] MotionVariance motion_variance(const Context& ctx) const {
    return present_.motion_variance(ctx.parameters);
  }
  [[nodiscard]] sensor::Mode mode(const Context&) const {
    if (!started_) return sensor::Mode::kWaitingForPose;
    if (!tracking()) return sensor::Mode::kAligning;
    return now_ - last_absolute_ > base::Micros{5'000'000} ? sensor::Mode::kDeadReckoning : sensor::Mode::kNominal;
  }
  /// East coordinate of the zero from which the cloud counts.
  [[nodiscard]] base::Anchored origin_x() const { return origin_x_; }
  /// Particles in use.
  [[nodiscard]] std::size_t size() const { return cloud_.cloud.size(); }

  /// All but the cloud, which digest() stands for.
  static constexpr auto members(auto& self) {
    return base::members(base::unhashed(self.cloud_), self.motion_, base::unhashed(self.present_), self.origin_x_,
                         self.origin_y_, base::first(self.batch_, self.batch_size_), base::unhashed(self.landmarks_),
                         base::count(self.batch_size_), self.batch_stamp_, self.moved_, self.last_absolute_,
                         base::unhashed(self.now_), self.digest_, self.started_);
  }
  [[nodiscard]] std::uint32_t digest() const { return digest_.value(); }
  /// Every particle, for a comparison of whole states.
  template <class Sink>
  void hash_memory(Sink&& sink) const {
    for (std::size_t i = 0; i < cloud_.cloud.size(); ++i) hash_particle(i, sink);
  }

 private:
  using Cloud = filter::ParticleLocalisation<kMost>;
  /// Increments of longer than this are not taken for one arc.
  static constexpr base::Micros kLongestArc{150'000};
  static constexpr float kFinest_m = 1e-3F, kFinest_rad = 1e-3F;
  static constexpr float kFarFromOrigin_m = 64;
  static constexpr std::uint32_t kKey = 0x7E7A9, kFirstSeed = 0x9AC0;

  /// One pose, and a heading that is known within a radian.
  [[nodiscard]] bool tracking() const { return started_ && !cloud_.lost() && !(motion_.filter.p(2, 2) > 1.0F); }
  template <class Sink>
  void hash_particle(std::size_t i, Sink& sink) const {
    const filter::ParticlePose& p = cloud_.cloud[i];
    for (const float v : {p.x_m, p.y_m, p.cos_yaw, p.sin_yaw, cloud_.cloud.log_weight(i)}) sink(v);
  }
  void move_cloud(base::Micros t, const Context& ctx);
  /// The batch of an earlier stamp goes into the cloud.
  void close_batch(base::Micros stamp, const Context& ctx) {
    if (batch_size_ > 0 && stamp > batch_stamp_) weigh_batch(ctx);
  }
  void weigh_batch(const Context& ctx);
  void start_within(std::span<const filter::ParticleLandmark> landmarks, float margin_m);
  void adopt_estimate();
  void follow_origin();

  Cloud cloud_;
  Motion motion_;                       ///< at the far end of the window, from the last batch on
  Motion present_;                      ///< the same carried over the window
  base::Anchored origin_x_, origin_y_;  ///< zero of the cloud's coordinates
  std::array<sensor::LandmarkSighting, kBatch> batch_{};
  std::array<filter::ParticleLandmark, kMapCapacity> landmarks_{};
  std::size_t batch_size_ = 0;
  base::Micros batch_stamp_;
  base::Micros moved_;  ///< time of the cloud's last motion
  base::Micros last_absolute_;
  base::Micros now_;  ///< unhashed: of the last tick, set anew by the next
  base::StateDigest digest_;
  bool started_ = false;  ///< the cloud stands for a pose
};

}  // namespace tetap::estimators
