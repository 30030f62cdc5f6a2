// SPDX-License-Identifier: Apache-2.0
// What the robot knows of its surroundings and all estimators share: the origin of the local plane and the landmark
// map.
#pragma once

#include "config/messages.hpp"
#include "model/landmark.hpp"
#include "nav/geodesy.hpp"

#include <array>
#include <cstddef>
#include <cstdint>

namespace tetap::app {

/// Known landmarks by id. When full, a new id is refused (put() false); a known id is moved.
template <std::size_t Capacity>
class LandmarkMap {
 public:
  [[nodiscard]] constexpr bool put(std::uint8_t id, const model::Landmark& landmark) {
    for (std::size_t i = 0; i < size_; ++i)
      if (ids_[i] == id) return landmarks_[i] = landmark, true;
    if (size_ == Capacity) return false;
    ids_[size_] = id;
    landmarks_[size_++] = landmark;
    return true;
  }
  [[nodiscard]] constexpr const model::Landmark* find(std::uint8_t id) const {
    for (std::size_t i = 0; i < size_; ++i)
      if (ids_[i] == id) return &landmarks_[i];
    return nullptr;
  }
  constexpr void clear() { size_ = 0; }
  [[nodiscard]] constexpr std::size_t size() const { return size_; }
  /// Feeds id and place of every entry to the sink, for hashes.
  template <class Sink>
  constexpr void each_bit(Sink&& sink) const {
    for (std::size_t i = 0; i < size_; ++i) {
      sink(static_cast<std::uint32_t>(ids_[i]));
      sink(landmarks_[i].x.um());
      sink(landmarks_[i].y.um());
    }
  }

 private:
  std::array<std::uint8_t, Capacity> ids_{};
  std::array<model::Landmark, Capacity> landmarks_{};
  std::size_t size_ = 0;
};

inline constexpr std::size_t kMapCapacity = 64;

struct Site {
  can::OriginSource origin = can::OriginSource::kNone;
  nav::LocalFrame frame;
  LandmarkMap<kMapCapacity> map;
};

}  // namespace tetap::app
