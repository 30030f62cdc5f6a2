// SPDX-License-Identifier: Apache-2.0
// Nucleo-G474RE (MB1367): STM32G474RE with an ICM-42688-P, a CAN transceiver, a GNSS receiver and encoders on its
// connectors. Pins: UM2505; alternate functions: data sheet DS12288, table "Alternate function". PB8 is BOOT0, which a
// transceiver would hold high, so CAN is on PA11 and PA12. Nobody has run this port on the board.
#pragma once

#include "hal/chip/stm32/g4_chip.hpp"
#include "hal/chip/stm32/wired_board.hpp"

#include <array>
#include <cstdint>

namespace tetap::hal::nucleo_g474re {

/// Chip, pins, rates and light, as WiredBoard asks for them.
struct Wiring {
  using Chip = stm32::G4Chip;

  // Settings that an owner may want to change.
  static constexpr std::uint32_t kCanBitRate = 500'000;
  /// A third of what the sensor takes: it hangs on loose wires.
  static constexpr std::uint32_t kMostImuClock_hz = 8'000'000;

  static constexpr const char* kUp = "tetap: nucleo_g474re up";
  static constexpr stm32::G4PllPlan kPll{.crystal_hz = 24'000'000, .core_hz = 160'000'000};
  static constexpr stm32::Pin kImuSelect = Chip::pa(4);
  /// A diode of one's own: the board's, LD2, hangs at PA5, which is SCK.
  static constexpr stm32::Pin kLed = Chip::pc(8);
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
      block_pin(Chip::pc(4), 7),                        // USART1_TX: GNSS
      block_pin(Chip::pc(5), 7, stm32::PinPull::kUp),   // USART1_RX
      block_pin(Chip::pa(11), 9, stm32::PinPull::kUp),  // FDCAN1_RX
      block_pin(Chip::pa(12), 9),                       // FDCAN1_TX
      output_pin(kLed, false),                          //
  };

  static void show_start(bool starting) { (starting ? kLed.set() : kLed.clear()); }
  /// The diode blinks on the bus and stands off it.
  static void show_bus(bool light, bool on_bus) { (light || !on_bus ? kLed.set() : kLed.clear()); }
};

using Board = stm32::WiredBoard<Wiring>;

}  // namespace tetap::hal::nucleo_g474re
