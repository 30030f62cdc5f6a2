// SPDX-License-Identifier: Apache-2.0
// A scan as its frames on the bus, for a node at base 0x300.
#pragma once

#include "tetap/bus/codec.hpp"
#include "tetap/bus/messages.hpp"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace tetap::test {

/// The head and the blocks of ranges (5 mm, 0: none).
[[nodiscard]] inline std::vector<base::CanFrame> scan_frames(std::int64_t at_us, int seq,
                                                             const std::vector<std::uint16_t>& ranges, float first_rad,
                                                             float step_rad) {
  const auto number = static_cast<std::uint8_t>(seq & 15);
  std::vector<base::CanFrame> frames{
      bus::frame(0x300, bus::InScanHead{.stamp_us = static_cast<std::uint32_t>(at_us & 0xFFFFF),
                                        .seq = number,
                                        .count = static_cast<std::uint16_t>(ranges.size()),
                                        .first_rad = first_rad,
                                        .step_rad = step_rad})};
  const auto range_m = [&](std::size_t i) { return i < ranges.size() ? 0.005F * static_cast<float>(ranges[i]) : 0.0F; };
  for (std::size_t i = 0; i < ranges.size(); i += 4)
    frames.push_back(bus::frame(0x300, bus::InScan{.seq = number,
                                                   .block = static_cast<std::uint8_t>(i / 4),
                                                   .range0_m = range_m(i),
                                                   .range1_m = range_m(i + 1),
                                                   .range2_m = range_m(i + 2),
                                                   .range3_m = range_m(i + 3)}));
  return frames;
}

}  // namespace tetap::test
