// SPDX-License-Identifier: Apache-2.0
// The landmarks of a mapper, of fixed capacity. A landmark's number may change when another one is removed: the last
// takes its place, as it does in the covariance.
#pragma once

#include "tetap/model/landmark.hpp"
#include "tetap/slam/sighting.hpp"

#include <array>
#include <cstddef>
#include <cstdint>

namespace tetap::slam {

struct MapLandmark {
  model::Landmark place;
  std::int64_t seen_us = 0;       ///< stamp of the last sighting that was accepted
  std::int64_t seen_path_um = 0;  ///< way of the robot until then
  std::uint16_t id = Sighting::kNoId;
  std::uint16_t hits = 0;  ///< accepted sightings, up to 65535
};

template <int kMost>
class LandmarkMap {
 public:
  static constexpr int kNone = -1;

  [[nodiscard]] int size() const { return size_; }
  [[nodiscard]] bool full() const { return size_ == kMost; }
  [[nodiscard]] const MapLandmark& operator[](int k) const { return entries_[static_cast<std::size_t>(k)]; }
  [[nodiscard]] MapLandmark& operator[](int k) { return entries_[static_cast<std::size_t>(k)]; }
  void clear() { size_ = 0; }

  [[nodiscard]] int find(std::uint16_t id) const {
    for (int k = 0; k < size_; ++k)
      if ((*this)[k].id == id) return k;
    return kNone;
  }
  /// The landmark unseen for longest, the first of equals, among those with fewer sightings than `below`.
  [[nodiscard]] int oldest(int below) const {
    int oldest = kNone;
    for (int k = 0; k < size_; ++k)
      if ((*this)[k].hits < below && (oldest == kNone || (*this)[k].seen_us < (*this)[oldest].seen_us)) oldest = k;
    return oldest;
  }
  /// False, and nothing has changed, when the map is full.
  [[nodiscard]] bool add(const MapLandmark& landmark) {
    if (full()) return false;
    (*this)[size_++] = landmark;
    return true;
  }
  void remove(int k) { (*this)[k] = (*this)[--size_]; }
  void seen(int k, std::int64_t stamp_us, std::int64_t path_um) {
    MapLandmark& landmark = (*this)[k];
    landmark.seen_us = stamp_us;
    landmark.seen_path_um = path_um;
    if (landmark.hits < 0xffff) ++landmark.hits;
  }

 private:
  int size_ = 0;
  std::array<MapLandmark, static_cast<std::size_t>(kMost)> entries_{};
};

}  // namespace tetap::slam
