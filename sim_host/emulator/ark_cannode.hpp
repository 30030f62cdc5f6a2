// SPDX-License-Identifier: Apache-2.0
// The wiring of an ARK CANnode: which pin goes where. Pins: ArduPilot hwdef/ARK_CANNODE and PX4 boards/ark/cannode,
// which agree. USART2 (PA2) is the console, USART1 the GNSS connector.
#pragma once

#include "sim_host/emulator/board.hpp"
#include "sim_host/emulator/stm32f412.hpp"

namespace tetap::board {

class ArkCannode : public Board {
 public:
  explicit ArkCannode(const BoardOptions& options = {}, SensorWorld world = {})
      : ArkCannode(std::make_unique<Stm32f412>(options.oscillators), options, std::move(world)) {}

  static constexpr Pin kImuSelect{'A', 4}, kImuReady{'B', 2}, kCanSilent{'C', 14}, kCanTerminator{'C', 15},
      kLedRed{'A', 8}, kLedGreen{'A', 9}, kLedBlue{'A', 10};

  Stm32f412& chip;

 private:
  ArkCannode(std::unique_ptr<Stm32f412> stm32f412, const BoardOptions& options, SensorWorld world);
};

}  // namespace tetap::board
