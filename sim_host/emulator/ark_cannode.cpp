// SPDX-License-Identifier: Apache-2.0
#include "sim_host/emulator/ark_cannode.hpp"

#include <utility>

namespace tetap::board {

ArkCannode::ArkCannode(std::unique_ptr<Stm32f412> stm32f412, const BoardOptions& options, SensorWorld world)
    : Board(std::move(stm32f412), options, std::move(world)), chip(static_cast<Stm32f412&>(processor)) {
  if (options.imu_present) {
    imu.on_int1 = [this](bool level) { chip.pins.drive(kImuReady, level); };
    chip.spi1.connect(imu, kImuSelect, chip.pins);
  }
  wire_encoders(chip.tim2, chip.tim3);
  wire_console(chip.usart2);
  wire_gnss(chip.usart1);
  chip.can1.line.transceiver_on = [this] { return !chip.pins.level(kCanSilent); };
}

}  // namespace tetap::board
