// SPDX-License-Identifier: Apache-2.0
// What the robot knows of its surroundings and all estimators share: the origin of the local plane and the landmark
// map.
#pragma once

#include "model/landmark.hpp"
#include "nav/geodesy.hpp"
#include "sensor/vocabulary.hpp"

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
    for (std::size_t i = 0; i < size_; ++i)
      if (entries_[i].id == id)
        return model::Landmark{.x = base::Anchored::from_um(std::int64_t{entries_[i].x_mm} * 1000),
                               .y = base::Anchored::from_um(std::int64_t{entries_[i].y_mm} * 1000)};
    return std::nullopt;
  }
  constexpr void clear() { size_ = 0; }
  [[nodiscard]] constexpr std::size_t size() const { return size_; }
  /// Feeds id and place of every entry to the sink, for hashes.
  template <class Sink>
  constexpr void hash_state(Sink&& sink) const {
    for (std::size_t i = 0; i < size_; ++i) {
      sink(static_cast<std::uint32_t>(entries_[i].id));
      sink(entries_[i].x_mm);
      sink(entries_[i].y_mm);
    }
  }

 private:
  std::array<MapEntry, Capacity> entries_{};
  std::size_t size_ = 0;
};

inline constexpr std::size_t kMapCapacity = 64;

struct MapFrame {
  sensor::OriginSource origin = sensor::OriginSource::kNone;
  nav::LocalFrame frame;
  const LandmarkMap<kMapCapacity>* map = nullptr;  ///< map for estimators that take landmarks; null: none does
};

}  // namespace tetap::estimators
