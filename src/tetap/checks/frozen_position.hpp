// SPDX-License-Identifier: Apache-2.0
// Frozen position: fixes that keep their coordinates to the last digit while the filter moves on.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/sensor/samples.hpp"

#include <bit>
#include <cstdint>

namespace tetap::checks {

class FrozenPosition {
 public:
  /// (east, north): offset of the filter by this fix. While a receiver repeats a fix the offset changes by the filter's
  /// own way; beyond `limit_m` of it the position is frozen.
  bool update(const sensor::GnssPosition& fix, float east_m, float north_m, float limit_m) {
    const std::uint32_t coordinates = static_cast<std::uint32_t>(fix.latitude_2ndeg) +
                                      2'654'435'761U * static_cast<std::uint32_t>(fix.longitude_2ndeg) +
                                      40'503U * std::bit_cast<std::uint32_t>(fix.height_m);
    if (coordinates != coordinates_) {
      *this = {};
      coordinates_ = coordinates;
      east_m_ = east_m;
      north_m_ = north_m;
    }
    const float d_east_m = east_m - east_m_, d_north_m = north_m - north_m_;
    frozen_ = frozen_ || d_east_m * d_east_m + d_north_m * d_north_m > limit_m * limit_m;
    return frozen_;
  }
  [[nodiscard]] bool frozen() const { return frozen_; }

  static constexpr auto members(auto& self) {
    return base::members(self.coordinates_, self.east_m_, self.north_m_, self.frozen_);
  }

 private:
  std::uint32_t coordinates_ = 0;   ///< hash of latitude, longitude and height
  float east_m_ = 0, north_m_ = 0;  ///< offset at the first fix with these coordinates
  bool frozen_ = false;
};

}  // namespace tetap::checks
