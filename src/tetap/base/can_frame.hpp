// SPDX-License-Identifier: Apache-2.0
// A CAN frame as data: what the codec fills, a port sends, and a log holds.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace tetap::base {

/// Capacity is 8 for classic CAN, 64 for CAN FD; nothing else in the code knows the number.
template <std::size_t Capacity>
struct BasicCanFrame {
  std::uint32_t id = 0;  ///< 11 bits, or 29 when `extended`
  bool extended = false;
  std::uint8_t size = 0;  ///< bytes used of `data`, <= Capacity
  std::array<std::uint8_t, Capacity> data{};

  friend constexpr bool operator==(const BasicCanFrame&, const BasicCanFrame&) = default;
};

using CanFrame = BasicCanFrame<8>;

}  // namespace tetap::base
