// SPDX-License-Identifier: Apache-2.0
// ARK CANnode: STM32F412CG, ICM-42688-P, CAN with transceiver, a GNSS port, encoders on the PWM pads. Pins: ArduPilot
// hwdef/ARK_CANNODE and PX4 boards/ark/cannode, which agree; alternate functions: data sheet DS11139, table "Alternate
// function mapping". Nobody has run this port on the board: it was executed in emulation.
#pragma once

#include "hal/chip/stm32/f4_chip.hpp"
#include "hal/chip/stm32/wired_board.hpp"

#include <array>
#include <cstdint>

namespace tetap::hal::ark_cannode {

/// Chip, pins, rates and lights, as WiredBoard asks for them.
struct Wiring {
  using Chip = stm32::F4Chip;

  // Settings that an owner may want to change.
  /// True for the node at an end of the bus: the 120 ohm on the board are switched on.
  static constexpr bool kTerminated = false;
  static constexpr std::uint32_t kCanBitRate = 500'000;
  /// Both PX4 and ArduPilot run the sensor at up to 8 MHz here.
  static constexpr std::uint32_t kMostImuClock_hz = 8'000'000;

  static constexpr const char* kUp = "tetap: ark_cannode up";
  static constexpr stm32::F4PllPlan kPll{.crystal_hz = 8'000'000, .core_hz = 96'000'000};
  static constexpr stm32::Pin kImuSelect = Chip::pa(4);
  static constexpr stm32::Pin kLedRed = Chip::pa(8), kLedGreen = Chip::pa(9), kLedBlue = Chip::pa(10);
  static constexpr std::array kPins{
      block_pin(Chip::pa(0), 1, stm32::PinPull::kUp),   // TIM2_CH1: left encoder, A
      block_pin(Chip::pa(1), 1, stm32::PinPull::kUp),   // TIM2_CH2: left encoder, B
      block_pin(Chip::pb(4), 2, stm32::PinPull::kUp),   // TIM3_CH1: right encoder, A
      block_pin(Chip::pb(5), 2, stm32::PinPull::kUp),   // TIM3_CH2: right encoder, B
      block_pin(Chip::pa(2), 7),                        // USART2_TX: console
      output_pin(kImuSelect, true),                     //
      block_pin(Chip::pa(5), 5),                        // SPI1_SCK
      block_pin(Chip::pa(6), 5, stm32::PinPull::kUp),   // SPI1_MISO: 0xFF without a chip
      block_pin(Chip::pa(7), 5),                        // SPI1_MOSI
      output_pin(Chip::pb(8), false),                   // FSYNC of the IMU, not used
      block_pin(Chip::pa(15), 7),                       // USART1_TX: GNSS
      block_pin(Chip::pb(3), 7, stm32::PinPull::kUp),   // USART1_RX
      block_pin(Chip::pa(11), 9, stm32::PinPull::kUp),  // CAN1_RX
      block_pin(Chip::pa(12), 9),                       // CAN1_TX
      output_pin(Chip::pc(14), false),                  // transceiver's silent input: low is on
      output_pin(Chip::pc(15), kTerminated),            // terminator
      // The diodes light when their pin is low.
      output_pin(kLedRed, true, stm32::PinDrive::kOpenDrain),
      output_pin(kLedGreen, true, stm32::PinDrive::kOpenDrain),
      output_pin(kLedBlue, true, stm32::PinDrive::kOpenDrain),
  };

  static void show_start(bool starting) { (starting ? kLedRed.clear() : kLedRed.set()); }
  static void show_bus(bool light, bool on_bus) {
    (light && on_bus ? kLedGreen.clear() : kLedGreen.set());
    (light && !on_bus ? kLedRed.clear() : kLedRed.set());
  }
};

using Board = stm32::WiredBoard<Wiring>;

}  // namespace tetap::hal::ark_cannode
