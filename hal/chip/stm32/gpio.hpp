// SPDX-License-Identifier: Apache-2.0
// Pins of an STM32 as a table that a board writes down: checked by the compiler, set up in one call. RM0402 chapter
// "General-purpose I/Os (GPIO)".
#pragma once

#include "hal/chip/stm32/registers_stm32f412.hpp"
#include "hal/chip/support/mmio.hpp"

#include <cstddef>
#include <cstdint>
#include <span>

namespace tetap::hal::stm32 {

struct Pin {
  std::uint32_t port = 0;   ///< base address of the port
  std::uint8_t number = 0;  ///< 0 to 15

  /// The pin's bit in IDR, ODR and the lower half of BSRR.
  [[nodiscard]] constexpr std::uint32_t bit() const { return std::uint32_t{1} << number; }
  void set() const { write_bsrr(bit()); }
  void clear() const { write_bsrr(bit() << stm32f412::gpio::bsrr::kBr0.lsb); }

  friend constexpr bool operator==(const Pin&, const Pin&) = default;

 private:
  void write_bsrr(std::uint32_t bits) const { Mmio{port}.write(stm32f412::gpio::bsrr::kOffset, bits); }
};

/// Values of the fields MODER, PUPDR, OSPEEDR and OTYPER.
enum class PinMode : std::uint8_t { kInput = 0, kOutput = 1, kAlternate = 2, kAnalog = 3 };
enum class PinPull : std::uint8_t { kNone = 0, kUp = 1, kDown = 2 };
enum class PinSpeed : std::uint8_t { kLow = 0, kMedium = 1, kFast = 2, kHigh = 3 };
enum class PinDrive : std::uint8_t { kPushPull = 0, kOpenDrain = 1 };

struct PinSetup {
  Pin pin;
  PinMode mode = PinMode::kInput;
  std::uint8_t alternate = 0;  ///< number of the alternate function, where `mode` is kAlternate
  PinPull pull = PinPull::kNone;
  PinSpeed speed = PinSpeed::kLow;
  PinDrive drive = PinDrive::kPushPull;
  bool high = false;  ///< level of an output from the start on
};

/// A block's pin; `function` is the number of its alternate function.
[[nodiscard]] constexpr PinSetup block_pin(Pin pin, std::uint8_t function, PinPull pull = PinPull::kNone) {
  return {.pin = pin, .mode = PinMode::kAlternate, .alternate = function, .pull = pull, .speed = PinSpeed::kMedium};
}
[[nodiscard]] constexpr PinSetup output_pin(Pin pin, bool high, PinDrive drive = PinDrive::kPushPull) {
  return {.pin = pin, .mode = PinMode::kOutput, .drive = drive, .high = high};
}

/// True when no pin has two owners and every number is one that a port has.
[[nodiscard]] constexpr bool pins_distinct(std::span<const PinSetup> pins) {
  for (std::size_t i = 0; i < pins.size(); ++i) {
    if (pins[i].pin.number > 15 || pins[i].alternate > 15) return false;
    for (std::size_t k = 0; k < i; ++k) {
      if (pins[k].pin == pins[i].pin) return false;
    }
  }
  return true;
}

/// The field of pin `number`, from that of the register's first pin.
[[nodiscard]] constexpr Field pin_field(Field first, std::uint32_t number) {
  return {static_cast<std::uint8_t>(first.lsb + number * first.width), first.width};
}

/// `registers`: the pin's port. Level, drive and function stand before the mode changes, so no pin shows a level that
/// nobody asked for.
template <class Registers>
void set_up(Registers registers, const PinSetup& setup) {
  namespace gpio = stm32f412::gpio;
  const auto put = [&registers](std::uint32_t offset, Field field, std::uint32_t value) {
    registers.write(offset, field.in(registers.read(offset), value));
  };
  const std::uint32_t n = setup.pin.number;
  const std::uint32_t high_half = setup.high ? 0 : gpio::bsrr::kBr0.lsb;
  if (setup.mode == PinMode::kOutput) registers.write(gpio::bsrr::kOffset, setup.pin.bit() << high_half);
  put(gpio::otyper::kOffset, pin_field(gpio::otyper::kOt0, n), static_cast<std::uint32_t>(setup.drive));
  put(gpio::ospeedr::kOffset, pin_field(gpio::ospeedr::kOspeedr0, n), static_cast<std::uint32_t>(setup.speed));
  put(gpio::pupdr::kOffset, pin_field(gpio::pupdr::kPupdr0, n), static_cast<std::uint32_t>(setup.pull));
  if (setup.mode == PinMode::kAlternate) {
    const bool low = n < 8;
    const Field first = low ? gpio::afrl::kAfrl0 : gpio::afrh::kAfrh8;
    put(low ? gpio::afrl::kOffset : gpio::afrh::kOffset, pin_field(first, low ? n : n - 8), setup.alternate);
  }
  put(gpio::moder::kOffset, pin_field(gpio::moder::kModer0, n), static_cast<std::uint32_t>(setup.mode));
}

}  // namespace tetap::hal::stm32
