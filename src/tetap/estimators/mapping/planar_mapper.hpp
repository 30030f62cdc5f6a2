// SPDX-License-Identifier: Apache-2.0
// Simultaneous localisation and mapping in the plane as an estimator: wheels, perhaps a gyroscope, and landmarks with
// range, bearing or both. The map is the robot's own, of fixed capacity, and goes out on the bus.
//
// Delayed: the mapper is at the far end of the window, where all sightings of one stamp reach it together. Dead
// reckoning carries its pose to the present, so a tick without a sighting costs what dead reckoning costs.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/base/state_digest.hpp"
#include "tetap/estimators/context.hpp"
#include "tetap/estimators/mapping/checked_motion.hpp"
#include "tetap/estimators/mapping/ekf_slam_engine.hpp"
#include "tetap/estimators/mapping/fast_slam_engine.hpp"
#include "tetap/estimators/own_map.hpp"
#include "tetap/sensor/window.hpp"

#include <array>
#include <cstddef>
#include <cstdint>

namespace tetap::estimators {

/// Engine: EkfSlamEngine or FastSlamEngine.
template <class Engine>
class PlanarMapper {
  using Motion = CheckedMotion;

 public:
  static constexpr sensor::EstimatorKind kKind = Engine::kKind;
  static constexpr bool kDelayed = true;
  /// Sightings without an identity find their landmarks by association.
  static constexpr bool kTakesNameless = Engine::kTakesNameless;
  /// Sightings of one stamp; those beyond are counted as not used.
  static constexpr std::size_t kBatch = Engine::kBatch;
  /// Words of memory that enter the digest in one tick.
  static constexpr std::size_t kScanned = 64;

  /// Without a start pose the robot's place is the origin of its own map.
  void restart(base::Micros t, const Context& ctx);
  /// Robot and map move rigidly: sightings before the command are fused before it.
  void set_pose(base::Micros t, const SetPose& given, const Context& ctx);
  void reset_own_map() {
    engine_.reset_map();
    digest_.update(kMapReset);
  }
  void advance(base::Micros t, const Context& ctx, const sensor::Window& window);

  template <class Input>
  requires requires(Motion& motion, const Input& input, const param::Parameters& n) {
    motion.fuse(input, base::Micros{}, n);
  }
  Innovation fuse(const Input& input, base::Micros stamp, const Context& ctx) {
    if (stamp > batch_stamp_) close_batch(ctx);
    const sensor::Verdict verdict = motion_.fuse(input, stamp, ctx.parameters);
    move_engine();
    return input_record(verdict);
  }
  /// Pending until all sightings of the stamp are there.
  Innovation fuse(const sensor::LandmarkSighting& sighting, base::Micros stamp, std::uint8_t instance,
                  const Context& ctx);
  /// Sightings that wait for others of their stamp are fused now.
  void close_batch(const Context& ctx);
  /// Records of the last batch, once.
  template <class Sink>
  void late_records(Sink&& sink) {
    for (std::size_t i = 0; i < records_; ++i) sink(record_[i]);
    records_ = 0;
  }

  [[nodiscard]] Estimate estimate(const Context& ctx) const {
    Estimate estimate = present_.estimate(ctx.parameters);
    estimate.p.add_diagonal({0.0F, 0.0F, present_.heading_rad2()});
    estimate.heading_valid = !(estimate.p(2, 2) > 1.0F);
    return estimate;
  }
  [[nodiscard]] MotionVariance motion_variance(const Context& ctx) const {
    return present_.motion_variance(ctx.parameters);
  }
  /// Degraded: wheels and gyroscope contradict each other.
  [[nodiscard]] sensor::Mode mode(const Context&) const {
    if (motion_.contradicts()) return sensor::Mode::kDegraded;
    return now_ - last_absolute_ > base::Micros{5'000'000} ? sensor::Mode::kDeadReckoning : sensor::Mode::kNominal;
  }
  /// Capacity, for a second after a landmark was refused; WheelSlip: wheels that turn otherwise than the gyroscope.
  [[nodiscard]] std::uint16_t faults() const {
    const bool full = refused_ > 0 && now_ - last_refused_ < base::Micros{1'000'000};
    const unsigned capacity = full ? 1U << static_cast<unsigned>(sensor::Fault::kCapacity) : 0U;
    return static_cast<std::uint16_t>(capacity | motion_.faults());
  }

  [[nodiscard]] MapReport own_map() const { return engine_.report(); }
  [[nodiscard]] MappedLandmark own_landmark(std::size_t i) const { return engine_.landmark(i, now_); }

  /// All but the engine, which digest() stands for.
  static constexpr auto members(auto& self) {
    return base::members(base::unhashed(self.engine_), self.motion_, base::unhashed(self.present_),
                         base::first(self.batch_, self.batch_size_),
                         base::first(self.batch_instance_, self.batch_size_), base::unhashed(self.record_),
                         base::count(self.batch_size_), base::count(self.records_), self.batch_stamp_,
                         self.last_absolute_, self.last_refused_, self.now_, self.refused_, self.digest_);
  }
  [[nodiscard]] std::uint32_t digest() const { return digest_.value(); }
  /// All of the engine's memory, for a comparison of whole states.
  template <class Sink>
  void hash_memory(Sink&& sink) const {
    for (std::size_t i = 0; i < engine_.words(); ++i) engine_.hash_word(i, sink);
  }

 private:
  static constexpr std::uint8_t kAnyLandmark = 0xFF;
  static constexpr std::uint32_t kMapReset = 0x4D41'5052;  ///< a word of its own in the digest

  void move_engine() {
    for (const model::PlanarIncrement& step : motion_.filter.take_steps()) engine_.predict(step);
  }
  void adopt_pose(const model::PlanarPose& pose, const filter::Symmetric<float, 3>& p) {
    motion_.filter.x = pose;
    motion_.filter.p = p;
  }

  Engine engine_;
  Motion motion_;   ///< at the far end of the window: the pose of the engine
  Motion present_;  ///< the same carried over the window
  std::array<slam::Sighting, kBatch> batch_{};
  std::array<std::uint8_t, kBatch> batch_instance_{};
  std::array<LateRecord, kBatch> record_{};
  std::size_t batch_size_ = 0, records_ = 0;
  base::Micros batch_stamp_;
  base::Micros last_absolute_;  ///< stamp of the last accepted sighting
  base::Micros last_refused_;
  base::Micros now_;
  std::uint32_t refused_ = 0;  ///< landmarks without room
  base::StateDigest digest_;
};

/// EKF-SLAM with thirty landmarks.
using EkfSlam30 = PlanarMapper<EkfSlamEngine<30>>;
/// FastSLAM 2 with a hundred particles of fifteen landmarks.
using FastSlam100 = PlanarMapper<FastSlamEngine<100, 15, 2>>;

}  // namespace tetap::estimators
