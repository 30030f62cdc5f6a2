// SPDX-License-Identifier: Apache-2.0
// A kind of fault, as one row of a robot's table: what it does at first, how large and how often.
#pragma once

#include "tetap/base/float_bits.hpp"

#include <array>
#include <cstddef>
#include <cstdint>

namespace tetap::trust {

struct FaultRow {
  std::uint8_t code = 0;    ///< number of the row, its own in the table: sums go up in it, wherever the row stands
  std::uint8_t device = 0;  ///< device at fault; its probability is the sum over its rows
  std::int8_t jumps = -1;   ///< error that the fault makes larger at once; -1: the fault is one of a measurement
  float largest = 1;        ///< largest plausible size, 1 sigma
  float per_hour = 1;       ///< how often such a fault begins
};

/// A device that is at fault by all that its rows show, and its likeliest row.
struct LikelyFault {
  static constexpr std::uint8_t kNone = 15;
  std::uint8_t code = kNone;  ///< row of the table
  float probability = 0;      ///< probability of its device
  float size = base::kNan;    ///< size, in the row's unit
  float sigma = base::kNan;   ///< 1 sigma of the size
};

/// Places of the rows in the order of their codes.
template <std::size_t kCount>
[[nodiscard]] constexpr std::array<std::uint8_t, kCount> by_code(const std::array<FaultRow, kCount>& rows) {
  std::array<std::uint8_t, kCount> place{};
  for (std::size_t i = 0; i < kCount; ++i) {
    std::size_t at = 0;
    for (std::size_t j = 0; j < kCount; ++j) at += rows[j].code < rows[i].code ? 1U : 0U;
    place[at] = static_cast<std::uint8_t>(i);
  }
  return place;
}

}  // namespace tetap::trust
