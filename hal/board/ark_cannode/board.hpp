// SPDX-License-Identifier: Apache-2.0
// ARK CANnode: STM32F412CG, ICM-42688-P, CAN with transceiver, a GNSS port, encoders on the PWM pads. Pins: ArduPilot
// hwdef/ARK_CANNODE and PX4 boards/ark/cannode, which agree; alternate functions: data sheet DS11139, table "Alternate
// function mapping". Nobody has run this port on the board: it was executed in emulation.
#pragma once

#include "hal/chip/stm32/f4_board.hpp"

#include <array>
#include <cstdint>

namespace tetap::hal::ark_cannode {

namespace chip = stm32f412;
using stm32::Pin, stm32::PinMode, stm32::PinPull, stm32::PinSpeed, stm32::PinDrive, stm32::PinSetup;

// Settings that an owner may want to change.

/// True for the node at an end of the bus: the 120 ohm on the board are switched on.
inline constexpr bool kTerminated = false;
inline constexpr std::uint32_t kCanBitRate = 500'000;
inline constexpr std::uint32_t kConsoleBaud = 115'200;
/// Until a driver sets another one; the rate of new u-blox receivers.
inline constexpr std::uint32_t kGnssBaud = 38'400;
/// Both PX4 and ArduPilot run the sensor at up to 8 MHz here.
inline constexpr std::uint32_t kMostImuClock_hz = 8'000'000;

// Pins.

inline constexpr Pin kImuSelect{chip::gpio::kGpioa, 4};
inline constexpr Pin kLedRed{chip::gpio::kGpioa, 8}, kLedGreen{chip::gpio::kGpioa, 9}, kLedBlue{chip::gpio::kGpioa, 10};

namespace detail {
constexpr Pin pa(std::uint8_t number) { return {chip::gpio::kGpioa, number}; }
constexpr Pin pb(std::uint8_t number) { return {chip::gpio::kGpiob, number}; }
constexpr Pin pc(std::uint8_t number) { return {chip::gpio::kGpioc, number}; }
constexpr PinSetup function(Pin pin, std::uint8_t alternate, PinPull pull = PinPull::kNone) {
  return {.pin = pin, .mode = PinMode::kAlternate, .alternate = alternate, .pull = pull, .speed = PinSpeed::kMedium};
}
constexpr PinSetup output(Pin pin, bool high, PinDrive drive = PinDrive::kPushPull) {
  return {.pin = pin, .mode = PinMode::kOutput, .drive = drive, .high = high};
}
}  // namespace detail

inline constexpr std::array kPins{
    detail::function(detail::pa(0), 1, PinPull::kUp),   // TIM2_CH1: left encoder, A
    detail::function(detail::pa(1), 1, PinPull::kUp),   // TIM2_CH2: left encoder, B
    detail::function(detail::pb(4), 2, PinPull::kUp),   // TIM3_CH1: right encoder, A
    detail::function(detail::pb(5), 2, PinPull::kUp),   // TIM3_CH2: right encoder, B
    detail::function(detail::pa(2), 7),                 // USART2_TX: console
    detail::output(kImuSelect, true),                   //
    detail::function(detail::pa(5), 5),                 // SPI1_SCK
    detail::function(detail::pa(6), 5, PinPull::kUp),   // SPI1_MISO: 0xFF without a chip
    detail::function(detail::pa(7), 5),                 // SPI1_MOSI
    detail::output(detail::pb(8), false),               // FSYNC of the IMU, not used
    detail::function(detail::pa(15), 7),                // USART1_TX: GNSS
    detail::function(detail::pb(3), 7, PinPull::kUp),   // USART1_RX
    detail::function(detail::pa(11), 9, PinPull::kUp),  // CAN1_RX
    detail::function(detail::pa(12), 9),                // CAN1_TX
    detail::output(detail::pc(14), false),              // transceiver's silent input: low is on
    detail::output(detail::pc(15), kTerminated),        // terminator
    // The diodes light when their pin is low.
    detail::output(kLedRed, true, PinDrive::kOpenDrain),
    detail::output(kLedGreen, true, PinDrive::kOpenDrain),
    detail::output(kLedBlue, true, PinDrive::kOpenDrain),
};
static_assert(stm32::pins_distinct(kPins));

// Clocks and times.

inline constexpr stm32::PllPlan kPll{.crystal_hz = 8'000'000, .core_hz = 96'000'000};
static_assert(kPll.valid());

/// At APB1's clock with the PLL, and at the internal oscillator's without.
inline constexpr stm32::CanBitTiming kCanTiming = stm32::can_bit_timing(kPll.core_hz / 2, kCanBitRate);
inline constexpr stm32::CanBitTiming kSlowCanTiming = stm32::can_bit_timing(stm32::PllPlan::kInternal_hz, kCanBitRate);

/// The bus's bit timing, the pins and the lights, as F4Board asks for them.
struct Wiring {
  static constexpr const char* kUp = "tetap: ark_cannode up";
  static constexpr const auto& kPins = ark_cannode::kPins;
  static constexpr Pin kImuSelect = ark_cannode::kImuSelect;
  static constexpr stm32::PllPlan kPll = ark_cannode::kPll;
  static constexpr stm32::CanBitTiming kCanTiming = ark_cannode::kCanTiming,
                                       kSlowCanTiming = ark_cannode::kSlowCanTiming;
  static constexpr std::uint32_t kConsoleBaud = ark_cannode::kConsoleBaud, kGnssBaud = ark_cannode::kGnssBaud,
                                 kMostImuClock_hz = ark_cannode::kMostImuClock_hz;

  static void show_start(bool starting) { (starting ? kLedRed.clear() : kLedRed.set()); }
  static void show_bus(bool light, bool on_bus) {
    (light && on_bus ? kLedGreen.clear() : kLedGreen.set());
    (light && !on_bus ? kLedRed.clear() : kLedRed.set());
  }
};

using Board = stm32::F4Board<Wiring>;
inline constexpr auto kSystem = stm32::kF4System;
inline constexpr auto kInterrupts = stm32::kF4Interrupts;
inline constexpr int kLastInterrupt = stm32::kF4LastInterrupt;

static_assert(hal::SensorBoard<Board> && hal::IdleBoard<Board> && hal::WatchdogBoard<Board> &&
              hal::ReportingBoard<Board>);
static_assert(hal::ImuBoard<Board> && hal::EncoderBoard<Board> && hal::GnssBoard<Board>);
static_assert(hal::SerialPort<stm32::F4GnssPort>);

}  // namespace tetap::hal::ark_cannode
