// SPDX-License-Identifier: Apache-2.0
// Surroundings that all estimators share: the origin of the local plane and the landmark map.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/base/trig.hpp"
#include "tetap/model/landmark.hpp"
#include "tetap/nav/geodesy.hpp"
#include "tetap/sensor/samples.hpp"
#include "tetap/sensor/vocabulary.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace tetap::estimators {

/// A landmark as the bus states it, in whole millimetres: a third of the memory of a model::Landmark.
struct MapEntry {
  std::int32_t x_mm = 0;
  std::int32_t y_mm = 0;
  std::uint8_t id = 0;
};

/// Known landmarks by id. When full, a new id is refused (put() false); a known id is moved.
template <std::size_t Capacity>
class LandmarkMap {
 public:
  [[nodiscard]] constexpr bool put(const MapEntry& entry) {
    for (std::size_t i = 0; i < size_; ++i)
      if (entries_[i].id == entry.id) return entries_[i] = entry, true;
    if (size_ == Capacity) return false;
    entries_[size_++] = entry;
    return true;
  }
  [[nodiscard]] constexpr std::optional<model::Landmark> find(std::uint8_t id) const {
    const std::int32_t at = index(id);
    if (at < 0) return std::nullopt;
    return entry(static_cast<std::size_t>(at));
  }
  /// Place of the id among the entries; -1 where there is none.
  [[nodiscard]] constexpr std::int32_t index(std::uint8_t id) const {
    for (std::size_t i = 0; i < size_; ++i)
      if (entries_[i].id == id) return static_cast<std::int32_t>(i);
    return -1;
  }
  /// The landmark at a place below size().
  [[nodiscard]] constexpr model::Landmark entry(std::size_t i) const {
    return {.x = base::Anchored::from_um(std::int64_t{entries_[i].x_mm} * 1000),
            .y = base::Anchored::from_um(std::int64_t{entries_[i].y_mm} * 1000)};
  }
  /// Identity of the landmark at a place below size().
  [[nodiscard]] constexpr std::uint8_t id(std::size_t i) const { return entries_[i].id; }
  constexpr void clear() { size_ = 0; }
  [[nodiscard]] constexpr std::size_t size() const { return size_; }
  /// Feeds id and place of every entry to the sink, for hashes.
  static constexpr auto members(auto& self) {
    return base::members(base::first(self.entries_, self.size_), base::count(self.size_));
  }

 private:
  std::array<MapEntry, Capacity> entries_{};
  std::size_t size_ = 0;
};

inline constexpr std::size_t kMapCapacity = 64;

/// The map is promised to 100 km from its origin, along the ground. Beyond a little more no position is valid.
inline constexpr float kRange_m = 105'000;

/// Distance from the origin in the plane of the map; without a division, to half a metre.
[[nodiscard]] constexpr bool within_range(const base::Anchored& x, const base::Anchored& y) {
  const auto metres = [](const base::Anchored& a) {
    return static_cast<float>(static_cast<std::int32_t>(a.anchor_um >> 20)) * 1.048576F + a.offset_m;
  };
  const float east_m = metres(x), north_m = metres(y);
  return east_m * east_m + north_m * north_m <= kRange_m * kRange_m;
}

/// The same for a fix, by the haversine of the distance on a sphere (Sinnott 1984, Sky and Telescope 68(2)). The sphere
/// has the least radius of curvature: the fix of a position within the range is within it.
[[nodiscard]] inline bool within_range(const nav::LocalFrame& frame, const sensor::GnssPosition& fix) {
  constexpr std::int64_t kNear_2ndeg = 150'000'000;  // 0.3 deg both ways: 50 km at most
  constexpr float kRad = 2e-9F * 0.0174532925F, kRadius_m = 6'335'000;
  const std::int64_t north = fix.latitude_2ndeg - frame.latitude_2ndeg();
  const std::int64_t east = nav::longitude_difference_2ndeg(fix.longitude_2ndeg, frame.longitude_2ndeg());
  if (north < kNear_2ndeg && north > -kNear_2ndeg && east < kNear_2ndeg && east > -kNear_2ndeg) return true;
  const float by_north = base::sin(0.5F * kRad * static_cast<float>(north));
  const float by_east = base::sin(0.5F * kRad * static_cast<float>(east));
  const float cosine = frame.curvature().axis_north * base::cos(kRad * static_cast<float>(fix.latitude_2ndeg));
  constexpr float kMost = kRange_m / (2 * kRadius_m);  // sine of half the angle; the chord, but for 1e-5
  return by_north * by_north + cosine * by_east * by_east <= kMost * kMost;
}

struct MapFrame {
  sensor::OriginSource origin = sensor::OriginSource::kNone;
  nav::LocalFrame frame;
  const LandmarkMap<kMapCapacity>* map = nullptr;  ///< map for estimators that take landmarks; null: none does

  static constexpr auto members(auto& self) {
    return base::members(self.origin, base::in_turns(self.frame), base::own(self.map));
  }
};

}  // namespace tetap::estimators
