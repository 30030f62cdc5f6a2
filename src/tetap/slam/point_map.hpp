// SPDX-License-Identifier: Apache-2.0
// Points that a camera recognises again, in fixed memory: their places. Their errors are states of the filter, three
// each, in the order of this map.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/nav/so3.hpp"

#include <array>
#include <cstddef>
#include <cstdint>

namespace tetap::slam {

struct MapPoint {
  nav::Vector3 at_n_m = nav::Vector3::Zero();
  /// Where it was when it joined the map. The rows of a turn are those of this place: a turn of the whole world then
  /// stays invisible, whatever the filter learns of the point (Li & Mourikis 2013).
  nav::Vector3 first_n_m = nav::Vector3::Zero();
  std::int64_t seen_us = 0;  ///< stamp of the latest sighting that moved the state
  std::uint16_t id = 0;
  std::uint16_t hits = 0;    ///< sightings that moved the state
  std::uint16_t misses = 0;  ///< sightings that were gated, in a row
};

template <int kPoints>
class PointMap {
 public:
  static constexpr int kNone = -1;

  [[nodiscard]] int size() const { return size_; }
  [[nodiscard]] const MapPoint& operator[](int i) const { return point_[at(i)]; }
  [[nodiscard]] MapPoint& operator[](int i) { return point_[at(i)]; }
  [[nodiscard]] int find(std::uint16_t id) const {
    for (int i = 0; i < size_; ++i)
      if (point_[at(i)].id == id) return i;
    return kNone;
  }
  void clear() { size_ = 0; }
  void add(const MapPoint& point) {
    if (size_ < kPoints) point_[at(size_++)] = point;
  }
  /// The last point takes its place, as its states do in filter::BigCovariance.
  void remove(int i) { point_[at(i)] = point_[at(--size_)]; }
  void correct(const float* error) {
    for (int i = 0; i < size_; ++i)
      for (int k = 0; k < 3; ++k) point_[at(i)].at_n_m(k) += error[3 * i + k];
  }
  void shift(const nav::Vector3& by_m) {
    for (int i = 0; i < size_; ++i) {
      point_[at(i)].at_n_m += by_m;
      point_[at(i)].first_n_m += by_m;
    }
  }
  static constexpr auto members(auto& self) {
    return base::members(base::first(self.point_, static_cast<std::uint32_t>(self.size_)), self.size_);
  }

 private:
  static constexpr std::size_t at(int i) { return static_cast<std::size_t>(i); }

  std::array<MapPoint, static_cast<std::size_t>(kPoints)> point_{};
  std::int32_t size_ = 0;
};

/// A filter without a map has no memory for one.
template <>
class PointMap<0> {
 public:
  [[nodiscard]] static int size() { return 0; }
  static void clear() {}
  static void correct(const float*) {}
  static void shift(const nav::Vector3&) {}
  static constexpr auto members(auto&) { return base::members(); }
};

}  // namespace tetap::slam
