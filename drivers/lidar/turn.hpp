// SPDX-License-Identifier: Apache-2.0
// The returns of one turn of a planar scanner, in 360 bins of a degree. The nearest return of a bin counts: what is
// nearer is what a robot runs into.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace tetap::drivers {

class Turn {
 public:
  static constexpr std::size_t kBins = 360;
  static constexpr std::int32_t kBin_cdeg = 100;
  static constexpr std::int32_t kStep_mm = 5, kMost_steps = 8'190;  ///< range of In_Scan

  constexpr void clear() { ranges_ = {}; }
  /// The bin whose middle is nearest to an angle of [0, 36 000) hundredths of a degree.
  [[nodiscard]] static constexpr std::size_t bin(std::int32_t angle_cdeg) {
    return static_cast<std::size_t>((angle_cdeg + kBin_cdeg / 2) / kBin_cdeg) % kBins;
  }
  /// A return in a bin; 0, and what is beyond the range of the bus, is none.
  constexpr void add(std::size_t bin, std::int32_t distance_mm) {
    const std::int32_t steps = (distance_mm + kStep_mm / 2) / kStep_mm;
    if (steps == 0 || steps > kMost_steps) return;
    auto& range = ranges_[bin];
    if (range == 0 || steps < range) range = static_cast<std::uint16_t>(steps);
  }
  /// Range of each bin in steps of 5 mm; 0: none.
  [[nodiscard]] constexpr std::span<const std::uint16_t, kBins> ranges() const { return ranges_; }

 private:
  std::array<std::uint16_t, kBins> ranges_{};
};

}  // namespace tetap::drivers
