// SPDX-License-Identifier: Apache-2.0
// EKF-SLAM as PlanarMapper asks for it.
#pragma once

#include "tetap/estimators/mapping/sighting_record.hpp"
#include "tetap/estimators/own_map.hpp"
#include "tetap/filter/update.hpp"
#include "tetap/param/parameters.hpp"
#include "tetap/slam/ekf_mapper.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace tetap::estimators {

template <int kLandmarks>
class EkfSlamEngine {
 public:
  static constexpr sensor::EstimatorKind kKind = sensor::EstimatorKind::kEkfSlam;
  static constexpr std::size_t kBatch = 16;
  static constexpr bool kTakesNameless = true;

  void configure(const param::Parameters& n) {
    slam::EkfSlamOptions& core = mapper_.core.options;
    core.noise = {.sigma_range_m = n.landmark.sigma_range_m,
                  .sigma_range_per_m = n.landmark.sigma_range_per_m,
                  .sigma_bearing_rad = n.landmark.sigma_bearing_rad};
    core.mounting = n.landmark.mounting;
    core.gate = n.landmark.gate_scale * filter::chi_square_99(2);
    core.gate_of_one = n.landmark.gate_scale * filter::chi_square_99(1);
    core.correlation_m = n.mapping.correlation_m;
    core.confirming_hits = static_cast<std::uint16_t>(n.mapping.confirming_hits);
    core.when_full = n.mapping.when_full == 0 ? slam::WhenFull::kRefuse : slam::WhenFull::kReplaceOldest;
    mapper_.options.method = static_cast<slam::AssociationMethod>(n.mapping.association);
    mapper_.options.separation_m = n.mapping.separation_m;
  }
  void start(const model::PlanarPose& pose, const filter::Symmetric<float, 3>& p) { mapper_.start(pose, p); }
  /// Robot and map move as one.
  void set_pose(const model::PlanarPose& pose, const filter::Symmetric<float, 3>& p) { mapper_.set_pose(pose, p); }
  void reset_map() { mapper_.reset_map(); }
  void predict(const model::PlanarIncrement& increment) { static_cast<void>(mapper_.predict(increment)); }
  std::span<const slam::SightingRecord> update(std::span<const slam::Sighting> seen, base::Micros stamp) {
    return mapper_.update(seen, stamp.us);
  }
  [[nodiscard]] model::PlanarPose pose() const { return mapper_.core.pose(); }
  [[nodiscard]] filter::Symmetric<float, 3> covariance() const { return mapper_.core.pose_covariance(); }

  [[nodiscard]] MapReport report() const {
    return {.size = static_cast<std::uint32_t>(mapper_.core.map().size()),
            .refused = mapper_.core.counts().no_room,
            .ambiguous = mapper_.counts().ambiguous};
  }
  [[nodiscard]] MappedLandmark landmark(std::size_t i, base::Micros now) const {
    const int k = static_cast<int>(i);
    const slam::MapLandmark& landmark = mapper_.core.map()[k];
    const slam::Covariance2 p = mapper_.core.landmark_covariance(k);
    return {.id = bus_id(landmark.id),
            .place = landmark.place,
            .xx_m2 = p.xx,
            .xy_m2 = p.xy,
            .yy_m2 = p.yy,
            .hits = landmark.hits,
            .age = now - base::Micros{landmark.seen_us},
            .confirmed = landmark.hits >= mapper_.core.options.confirming_hits};
  }

  /// Words of memory: the covariance, then three of each landmark.
  [[nodiscard]] std::size_t words() const {
    return mapper_.core.covariance().words() + 3 * static_cast<std::size_t>(mapper_.core.map().size());
  }
  template <class Sink>
  void hash_word(std::size_t i, Sink& sink) const {
    const std::size_t of_covariance = mapper_.core.covariance().words();
    if (i < of_covariance) return void(sink(mapper_.core.covariance().word(i)));
    const slam::MapLandmark& landmark = mapper_.core.map()[static_cast<int>((i - of_covariance) / 3)];
    switch ((i - of_covariance) % 3) {
      case 0:
        return void(sink(landmark.place.x.um()));
      case 1:
        return void(sink(landmark.place.y.um()));
      default:
        return void(sink(static_cast<std::uint32_t>(landmark.id) << 16 | landmark.hits));
    }
  }

 private:
  slam::EkfMapper<kLandmarks, static_cast<int>(kBatch)> mapper_;
};

}  // namespace tetap::estimators
