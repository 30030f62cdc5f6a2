// SPDX-License-Identifier: Apache-2.0
// Netduino Plus 2: STM32F405RG with a crystal of 25 MHz; sensors and a CAN transceiver hang on its headers. Alternate
// functions: data sheet DS8626, table "Alternate function mapping". QEMU executes this image as a second judge; it has
// no clock tree, CAN, DMA or sensors, so the port's bounded waits end and the internal oscillator is reported.
#pragma once

#include "hal/board/netduinoplus2/same_places.hpp"
#include "hal/chip/stm32/f4_chip.hpp"
#include "hal/chip/stm32/wired_board.hpp"

#include <array>
#include <cstdint>

namespace tetap::hal::netduinoplus2 {

/// Chip, pins, rates and light, as WiredBoard asks for them.
struct Wiring {
  using Chip = stm32::F4Chip;

  static constexpr std::uint32_t kCanBitRate = 500'000, kMostImuClock_hz = 8'000'000;
  static constexpr const char* kUp = "tetap: netduinoplus2 up";
  static constexpr stm32::F4PllPlan kPll{
      .crystal_hz = 25'000'000, .core_hz = 80'000'000, .limits = stm32::kStm32f405Clocks};
  static constexpr stm32::Pin kImuSelect = Chip::pa(4), kLed = Chip::pa(10);
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
      block_pin(Chip::pb(6), 7),                        // USART1_TX: GNSS
      block_pin(Chip::pb(7), 7, stm32::PinPull::kUp),   // USART1_RX
      block_pin(Chip::pa(11), 9, stm32::PinPull::kUp),  // CAN1_RX
      block_pin(Chip::pa(12), 9),                       // CAN1_TX
      output_pin(kLed, false),                          //
  };

  static void show_start(bool starting) { (starting ? kLed.set() : kLed.clear()); }
  /// The light blinks on the bus and stands off it.
  static void show_bus(bool light, bool on_bus) { (light || !on_bus ? kLed.set() : kLed.clear()); }
};

using Board = stm32::WiredBoard<Wiring>;

}  // namespace tetap::hal::netduinoplus2
