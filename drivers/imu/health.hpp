// SPDX-License-Identifier: Apache-2.0
// Health of an IMU as its driver reports it: a state, a reason for everything that went wrong, a count of each.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace tetap::drivers {

/// `State`: begins at its first enumerator. `Reason`: an enumeration from 0 on that ends with kCount.
template <class State, class Reason>
struct ImuDriverHealth {
  State state{};
  Reason last = Reason::kCount;  ///< kCount: nothing yet
  std::uint32_t samples = 0;     ///< delivered since the start
  std::uint32_t restarts = 0;
  std::array<std::uint16_t, static_cast<std::size_t>(Reason::kCount)> counts{};  ///< saturating

  [[nodiscard]] constexpr std::uint16_t of(Reason reason) const { return counts[static_cast<std::size_t>(reason)]; }

  constexpr void add(Reason reason, std::uint32_t times = 1) {
    auto& count = counts[static_cast<std::size_t>(reason)];
    const std::uint32_t sum = count + (times > 0xFFFF ? 0xFFFF : times);
    count = static_cast<std::uint16_t>(sum > 0xFFFF ? 0xFFFF : sum);
    last = reason;
  }
};

}  // namespace tetap::drivers
