// SPDX-License-Identifier: Apache-2.0
// Ranges of the latest scans, outside of the fusion window: a window of samples has no room for them. A sample names a
// scan by its number, and a scan gives way to the newest one.
#pragma once

#include "tetap/sensor/samples.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace tetap::sensor {

/// kScans scans of up to kBeams ranges each.
template <int kScans, int kBeams>
class ScanPool {
  static_assert(kScans >= 2, "one that is read, and one that comes in");

 public:
  static constexpr int kMostBeams = kBeams;

  void power_on() { number_ = 0; }
  /// A new scan, whose ranges put() gives.
  void begin() { ++number_; }
  /// Range of a beam of the newest scan, in steps of 5 mm; beam < kBeams.
  void put(std::uint16_t beam, std::uint16_t range) { ranges_[slot(number_)][beam] = range; }
  /// Number of the newest scan, counted from 1.
  [[nodiscard]] std::uint32_t newest() const { return number_; }
  /// Ranges of a scan in steps of 5 mm, 0 for none; empty when it has given way.
  [[nodiscard]] std::span<const std::uint16_t> ranges(const PlanarScan& scan) const {
    if (scan.number == 0 || number_ - scan.number >= static_cast<std::uint32_t>(kScans)) return {};
    return std::span(ranges_[slot(scan.number)]).first(scan.beams);
  }

 private:
  [[nodiscard]] static std::size_t slot(std::uint32_t number) { return number % static_cast<std::uint32_t>(kScans); }

  std::array<std::array<std::uint16_t, kBeams>, kScans> ranges_{};
  std::uint32_t number_ = 0;
};

using Scans = ScanPool<2, 512>;

}  // namespace tetap::sensor
