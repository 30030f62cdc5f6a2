// SPDX-License-Identifier: Apache-2.0
#include "sim_host/emulator/nucleo_g474re.hpp"

#include <utility>

namespace tetap::board {

namespace {

Oscillators with_crystal(Oscillators oscillators) {
  oscillators.hse_hz = NucleoG474re::kCrystal_hz;
  return oscillators;
}

}  // namespace

NucleoG474re::NucleoG474re(const BoardOptions& options, SensorWorld world)
    : NucleoG474re(std::make_unique<Stm32g474>(with_crystal(options.oscillators), kPins), options, std::move(world)) {}

NucleoG474re::NucleoG474re(std::unique_ptr<Stm32g474> stm32g474, const BoardOptions& options, SensorWorld world)
    : Board(std::move(stm32g474), options, std::move(world)), chip(static_cast<Stm32g474&>(processor)) {
  if (options.imu_present) {
    imu.on_int1 = [this](bool level) { chip.pins.drive(kImuReady, level); };
    chip.spi1.connect(imu, kImuSelect, chip.pins);
  }
  wire_encoders(chip.tim2, chip.tim3);
  wire_console(chip.usart2);
  wire_gnss(chip.usart1);
}

}  // namespace tetap::board
