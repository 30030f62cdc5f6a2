// SPDX-License-Identifier: Apache-2.0
// A kind of fault, as one row of a robot's table: who, in which unit, what it does at first, how large and how often.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace tetap::trust {

/// Whoever fails as one: a receiver with position and velocity is one device.
enum class Device : std::uint8_t { kImu = 0, kReceiver = 1, kWheels = 2, kHeading = 3, kBarometer = 4 };
inline constexpr std::size_t kDevices = 5;

/// Unit of a fault's size.
enum class FaultUnit : std::uint8_t {
  kMetres = 0,
  kMetresPerSecond = 1,
  kMetresPerSecond2 = 2,
  kRadians = 3,
  kRadiansPerSecond = 4
};

struct FaultRow {
  Device device = Device::kImu;
  FaultUnit unit = FaultUnit::kMetres;
  std::uint8_t code = 0;   ///< number of the row, its own in the table: sums go up in it, wherever the row stands
  std::int8_t jumps = -1;  ///< error that the fault makes larger at once; -1: the fault is one of a measurement
  float largest = 1;       ///< largest plausible size, 1 sigma
  float per_hour = 1;      ///< how often such a fault begins
  float wander_rts = 0;    ///< change of a measurement's fault while it lasts, per square root of a second
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
