// SPDX-License-Identifier: Apache-2.0
// What a CAN controller reports of itself.
#pragma once

#include <cstdint>

namespace tetap::base {

/// Errors on the controller's side, counted since start, never reset.
struct CanFaults {
  std::uint32_t rx_overflow = 0;  ///< frames the controller or the socket had to drop
  std::uint32_t tx_full = 0;      ///< frames send() refused
  std::uint32_t bus_off = 0;      ///< times the controller left the bus, or the interface was down
  std::uint32_t tx_high = 0;      ///< most frames that waited to be sent at once
};

}  // namespace tetap::base
