// SPDX-License-Identifier: Apache-2.0
// The landmark map and the entries that wait for their tick to go into it.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/base/state_hash.hpp"
#include "tetap/base/state_words.hpp"
#include "tetap/bus/counters.hpp"
#include "tetap/estimators/map_frame.hpp"

#include <array>
#include <cstddef>
#include <cstdint>

namespace tetap::node {

class Landmarks {
 public:
  void power_on(estimators::MapFrame& map_frame) {
    size_ = 0;
    map_frame.map = &map_;
    clear();
  }
  /// Entries wait sorted by id, so that the order of arrival has no effect.
  void add(const estimators::MapEntry& entry, bus::Counters& counters);
  [[nodiscard]] bool waiting() const { return size_ != 0; }
  void apply(bus::Counters& counters) {
    for (std::size_t i = 0; i < size_; ++i)
      if (!map_.put(waiting_[i])) ++counters.map_full;
    size_ = 0;
    digest();
  }
  void clear() {
    map_.clear();
    digest();
  }
  static constexpr auto members(auto& self) {
    return base::members(base::unhashed(self.map_), base::first(self.waiting_, self.size_), base::count(self.size_),
                         self.digest_);
  }

 private:
  void digest() {
    base::StateHash hash;
    base::each_word(map_, hash);
    digest_ = hash.value();
  }

  estimators::LandmarkMap<estimators::kMapCapacity> map_;
  std::array<estimators::MapEntry, estimators::kMapCapacity> waiting_{};
  std::size_t size_ = 0;
  std::uint32_t digest_ = 0;  ///< hash of map_, made when it changes: a map is as large as all other state together
};

/// For robots none of whose estimators takes landmarks: no memory, and entries are counted as not used.
struct NoLandmarks {
  static void power_on(estimators::MapFrame& map_frame) { map_frame.map = nullptr; }
  static void add(const estimators::MapEntry&, bus::Counters& counters) { ++counters.not_used; }
  [[nodiscard]] static bool waiting() { return false; }
  static void apply(bus::Counters&) {}
  static void clear() {}
  static constexpr auto members(auto&) { return base::members(); }
};

inline void Landmarks::add(const estimators::MapEntry& entry, bus::Counters& counters) {
  std::size_t at = size_;
  while (at > 0 && waiting_[at - 1].id >= entry.id) --at;
  if (at < size_ && waiting_[at].id == entry.id) {
    estimators::MapEntry& there = waiting_[at];  // of two within an epoch the one further east (or north) stands
    const bool beyond = entry.x_mm != there.x_mm ? entry.x_mm > there.x_mm : entry.y_mm > there.y_mm;
    if (beyond) there = entry;
    return;
  }
  if (size_ == estimators::kMapCapacity) {  // the highest ids are the ones refused, in whatever order they come
    ++counters.map_full;
    if (at == size_) return;
    --size_;
  }
  for (std::size_t i = size_; i > at; --i) waiting_[i] = waiting_[i - 1];
  waiting_[at] = entry;
  ++size_;
}

}  // namespace tetap::node
