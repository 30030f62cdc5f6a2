// SPDX-License-Identifier: Apache-2.0
// Netduino Plus 2: STM32F405RG with a crystal of 25 MHz; sensors and a CAN transceiver hang on its headers. Alternate
// functions: data sheet DS8626, table "Alternate function mapping". QEMU executes this image as a second judge; it has
// no clock tree, CAN, DMA or sensors, so the port's bounded waits end and the internal oscillator is reported.
#pragma once

#include "hal/board/netduinoplus2/same_places.hpp"
#include "hal/chip/stm32/f4_board.hpp"

#include <array>
#include <cstdint>

namespace tetap::hal::netduinoplus2 {

namespace chip = stm32f405;
using stm32::Pin, stm32::PinMode, stm32::PinPull, stm32::PinSpeed, stm32::PinSetup;

namespace detail {
constexpr Pin pa(std::uint8_t number) { return {chip::gpio::kGpioa, number}; }
constexpr Pin pb(std::uint8_t number) { return {chip::gpio::kGpiob, number}; }
constexpr PinSetup function(Pin pin, std::uint8_t alternate, PinPull pull = PinPull::kNone) {
  return {.pin = pin, .mode = PinMode::kAlternate, .alternate = alternate, .pull = pull, .speed = PinSpeed::kMedium};
}
constexpr PinSetup output(Pin pin, bool high) { return {.pin = pin, .mode = PinMode::kOutput, .high = high}; }
}  // namespace detail

inline constexpr std::uint32_t kCanBitRate = 500'000;

/// The bus's bit timing, the pins and the light, as F4Board asks for them.
struct Wiring {
  static constexpr const char* kUp = "tetap: netduinoplus2 up";
  static constexpr Pin kImuSelect = detail::pa(4);
  static constexpr Pin kLed = detail::pa(10);
  static constexpr std::array kPins{
      detail::function(detail::pa(0), 1, PinPull::kUp),   // TIM2_CH1: left encoder, A
      detail::function(detail::pa(1), 1, PinPull::kUp),   // TIM2_CH2: left encoder, B
      detail::function(detail::pb(4), 2, PinPull::kUp),   // TIM3_CH1: right encoder, A
      detail::function(detail::pb(5), 2, PinPull::kUp),   // TIM3_CH2: right encoder, B
      detail::function(detail::pa(2), 7),                 // USART2_TX: console
      detail::output(kImuSelect, true),                   //
      detail::function(detail::pa(5), 5),                 // SPI1_SCK
      detail::function(detail::pa(6), 5, PinPull::kUp),   // SPI1_MISO: 0xFF without a chip
      detail::function(detail::pa(7), 5),                 // SPI1_MOSI
      detail::function(detail::pb(6), 7),                 // USART1_TX: GNSS
      detail::function(detail::pb(7), 7, PinPull::kUp),   // USART1_RX
      detail::function(detail::pa(11), 9, PinPull::kUp),  // CAN1_RX
      detail::function(detail::pa(12), 9),                // CAN1_TX
      detail::output(kLed, false),                        //
  };
  static_assert(stm32::pins_distinct(kPins));

  static constexpr stm32::PllPlan kPll{
      .crystal_hz = 25'000'000, .core_hz = 80'000'000, .limits = stm32::kStm32f405Clocks};
  static_assert(kPll.valid());
  static constexpr stm32::CanBitTiming kCanTiming = stm32::can_bit_timing(kPll.core_hz / 2, kCanBitRate),
                                       kSlowCanTiming =
                                           stm32::can_bit_timing(stm32::PllPlan::kInternal_hz, kCanBitRate);
  static constexpr std::uint32_t kConsoleBaud = 115'200, kGnssBaud = 38'400, kMostImuClock_hz = 8'000'000;

  static void show_start(bool starting) { (starting ? kLed.set() : kLed.clear()); }
  /// The light blinks on the bus and stands off it.
  static void show_bus(bool light, bool on_bus) { (light || !on_bus ? kLed.set() : kLed.clear()); }
};

using Board = stm32::F4Board<Wiring>;
inline constexpr auto kSystem = stm32::kF4System;
inline constexpr auto kInterrupts = stm32::kF4Interrupts;
inline constexpr int kLastInterrupt = stm32::kF4LastInterrupt;

static_assert(hal::SensorBoard<Board> && hal::IdleBoard<Board> && hal::WatchdogBoard<Board> &&
              hal::ReportingBoard<Board>);
static_assert(hal::ImuBoard<Board> && hal::EncoderBoard<Board> && hal::GnssBoard<Board>);

}  // namespace tetap::hal::netduinoplus2
