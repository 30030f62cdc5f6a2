// SPDX-License-Identifier: Apache-2.0
// FastSLAM as PlanarMapper asks for it. Sightings need range, bearing and identity. Coordinates count from a zero that
// is where the robot was when it was last put somewhere.
#pragma once

#include "tetap/estimators/mapping/sighting_record.hpp"
#include "tetap/estimators/own_map.hpp"
#include "tetap/filter/update.hpp"
#include "tetap/param/parameters.hpp"
#include "tetap/slam/fast_slam.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace tetap::estimators {

template <int kParticles, int kLandmarks, int kVersion>
class FastSlamEngine {
 public:
  static constexpr sensor::EstimatorKind kKind = sensor::EstimatorKind::kFastSlam;
  static constexpr std::size_t kBatch = 16;
  static constexpr bool kTakesNameless = false;

  void configure(const param::Parameters& n) {
    slam_.options = {.noise = {.sigma_range_m = n.landmark.sigma_range_m,
                               .sigma_range_per_m = n.landmark.sigma_range_per_m,
                               .sigma_bearing_rad = n.landmark.sigma_bearing_rad},
                     .gate = n.landmark.gate_scale * filter::chi_square_99(2),
                     .resample_below = n.mapping.resample_share,
                     .correlation_m = n.mapping.correlation_m};
    slam_.set_key({static_cast<std::uint32_t>(n.mapping.seed), kKey});
    mounting_ = n.landmark.mounting;
    confirming_hits_ = static_cast<std::uint16_t>(n.mapping.confirming_hits);
  }
  void start(const model::PlanarPose& pose, const filter::Symmetric<float, 3>& p) {
    zero_x_ = pose.x;
    zero_y_ = pose.y;
    slam_.start({.yaw_rad = pose.yaw_rad}, base::sqrt(p(0, 0)), base::sqrt(p(2, 2)));
    after_ = slam_.estimate();
    refused_ = 0;
  }
  /// Robot and map move as one.
  void set_pose(const model::PlanarPose& pose, const filter::Symmetric<float, 3>& p) {
    zero_x_ = pose.x;
    zero_y_ = pose.y;
    slam_.set_pose({.yaw_rad = pose.yaw_rad}, base::sqrt(p(0, 0)), base::sqrt(p(2, 2)));
    after_ = slam_.estimate();
  }
  void reset_map() { slam_.reset_map(); }
  void predict(const model::PlanarIncrement& increment) { static_cast<void>(slam_.predict(increment)); }
  /// NIS of the records: against mean and covariance over the particles, pose and landmark taken for independent.
  std::span<const slam::SightingRecord> update(std::span<const slam::Sighting> seen, base::Micros stamp);

  /// Pose and covariance after the last update.
  [[nodiscard]] model::PlanarPose pose() const {
    const slam::PlanarOffset& pose = after_.pose;
    return {.x = zero_x_.plus(pose.x_m), .y = zero_y_.plus(pose.y_m), .yaw_rad = pose.yaw_rad};
  }
  [[nodiscard]] filter::Symmetric<float, 3> covariance() const {
    constexpr float kFinest_m2 = 1e-6F, kFinest_rad2 = 1e-6F;
    filter::Symmetric<float, 3> p = after_.p;
    p.add_diagonal({kFinest_m2, kFinest_m2, kFinest_rad2});
    return p;
  }

  [[nodiscard]] MapReport report() const {
    return {.size = static_cast<std::uint32_t>(slam_.landmarks()), .refused = refused_};
  }
  [[nodiscard]] MappedLandmark landmark(std::size_t i, base::Micros now) const {
    const slam::FastSlamLandmark landmark = slam_.landmark(static_cast<int>(i));
    return {.id = bus_id(slam_.id(static_cast<int>(i))),
            .place = {.x = zero_x_.plus(landmark.x_m), .y = zero_y_.plus(landmark.y_m)},
            .xx_m2 = landmark.p.xx,
            .xy_m2 = landmark.p.xy,
            .yy_m2 = landmark.p.yy,
            .hits = hits_[i],
            .age = now - seen_[i],
            .confirmed = hits_[i] >= confirming_hits_};
  }

  [[nodiscard]] std::size_t words() const { return slam_.words(); }
  template <class Sink>
  void hash_word(std::size_t i, Sink& sink) const {
    sink(slam_.word(i));
  }

 private:
  static constexpr std::uint32_t kKey = 7;  ///< second half of the key
  static constexpr int kNone = -1;

  [[nodiscard]] int find(std::uint16_t id) const {
    for (int k = 0; k < slam_.landmarks(); ++k)
      if (slam_.id(k) == id) return k;
    return kNone;
  }
  [[nodiscard]] slam::Sighting from_body(const slam::Sighting& seen) const;
  using Slam = slam::FastSlam<kParticles, kLandmarks, kVersion>;
  [[nodiscard]] slam::SightingRecord compare(const slam::Sighting& seen, const typename Slam::Estimate& at) const;

  Slam slam_;
  typename Slam::Estimate after_;
  model::PlanarMounting mounting_;
  base::Anchored zero_x_, zero_y_;
  std::array<slam::Sighting, kBatch> seen_b_{};
  std::array<slam::SightingRecord, kBatch> records_{};
  std::array<std::uint16_t, static_cast<std::size_t>(kLandmarks)> hits_{};
  std::array<base::Micros, static_cast<std::size_t>(kLandmarks)> seen_{};
  std::uint32_t refused_ = 0;
  std::uint16_t confirming_hits_ = 0;
};

/// The sighting as it would be from the body's origin.
template <int kParticles, int kLandmarks, int kVersion>
slam::Sighting FastSlamEngine<kParticles, kLandmarks, kVersion>::from_body(const slam::Sighting& seen) const {
  if (seen.components() != 2) return seen;
  const base::SinCos look = base::sincos(seen.bearing_rad + mounting_.yaw_rad);
  const float x_m = mounting_.x_b_m + seen.range_m * look.cos;
  const float y_m = mounting_.y_b_m + seen.range_m * look.sin;
  return {.id = seen.id, .range_m = base::sqrt(x_m * x_m + y_m * y_m), .bearing_rad = base::atan2(y_m, x_m)};
}

template <int kParticles, int kLandmarks, int kVersion>
slam::SightingRecord FastSlamEngine<kParticles, kLandmarks, kVersion>::compare(
    const slam::Sighting& seen, const typename Slam::Estimate& at) const {
  slam::SightingRecord record;
  record.id = seen.id;
  if (!seen.valid()) record.verdict = slam::SightingVerdict::kNotFinite;
  if (!seen.valid() || seen.components() != 2 || seen.id == slam::Sighting::kNoId) return record;
  record.components = 2;
  const int k = find(seen.id);
  if (k == kNone) {
    record.verdict =
        slam_.landmarks() < kLandmarks ? slam::SightingVerdict::kNewLandmark : slam::SightingVerdict::kNoRoom;
    return record;
  }
  const slam::FastSlamLandmark landmark = slam_.landmark(k);
  const slam::OffsetSight sight(at.pose, landmark.x_m, landmark.y_m, seen);
  record.nu = sight.nu;
  record.s = landmark.innovation(sight, slam_.options.noise);
  const std::array<std::array<float, 3>, 2> h{{{-sight.rx, -sight.ry, 0.0F}, {-sight.bx, -sight.by, -1.0F}}};
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) {
      const auto i = static_cast<std::size_t>(r), j = static_cast<std::size_t>(c);
      record.s.xx += h[0][i] * at.p(r, c) * h[0][j];
      record.s.xy += h[0][i] * at.p(r, c) * h[1][j];
      record.s.yy += h[1][i] * at.p(r, c) * h[1][j];
    }
  const slam::Root2 root(record.s);
  record.verdict = root.valid ? slam::SightingVerdict::kAccepted : slam::SightingVerdict::kSingular;
  if (!root.valid) return record;
  record.nis = root.squared(record.nu);
  if (!(record.nis <= slam_.options.gate)) record.verdict = slam::SightingVerdict::kRejected;
  return record;
}

template <int kParticles, int kLandmarks, int kVersion>
std::span<const slam::SightingRecord> FastSlamEngine<kParticles, kLandmarks, kVersion>::update(
    std::span<const slam::Sighting> seen, base::Micros stamp) {
  const auto before = slam_.estimate();
  const std::size_t count = seen.size() < kBatch ? seen.size() : kBatch;
  for (std::size_t i = 0; i < count; ++i) {
    seen_b_[i] = from_body(seen[i]);
    records_[i] = compare(seen_b_[i], before);
  }
  static_cast<void>(slam_.update({seen_b_.data(), count}));
  after_ = slam_.estimate();
  for (std::size_t i = 0; i < count; ++i) {
    slam::SightingRecord& record = records_[i];
    const int k = find(record.id);
    if (record.verdict == slam::SightingVerdict::kNewLandmark && k == kNone)  // others of the stamp took the last place
      record.verdict = slam::SightingVerdict::kNoRoom;
    if (record.verdict == slam::SightingVerdict::kNoRoom) ++refused_;
    if (k == kNone || record.components != 2) continue;
    if (record.verdict == slam::SightingVerdict::kNewLandmark) hits_[static_cast<std::size_t>(k)] = 0;
    if (hits_[static_cast<std::size_t>(k)] < 0xFFFF) ++hits_[static_cast<std::size_t>(k)];
    seen_[static_cast<std::size_t>(k)] = stamp;
  }
  return {records_.data(), count};
}

}  // namespace tetap::estimators
