// SPDX-License-Identifier: Apache-2.0
// Where a CAN controller stands towards the bus, for the bxCAN and the FDCAN alike.
#pragma once

#include <cstdint>

namespace tetap::hal::stm32 {

enum class CanState : std::uint8_t {
  kStopped,  ///< not started, or the controller does not follow a change of its mode
  kJoining,  ///< waits for 11 recessive bits in a row: the transceiver is silent or the bus is stuck as long as it
             ///< lasts
  kOnBus,
  kAway,       ///< after bus-off, for kBusOffHold
  kRecovering  ///< waits for the recessive bits that ISO 11898-1 asks of a node that was off: 128 times 11
};

}  // namespace tetap::hal::stm32
