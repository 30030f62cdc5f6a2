// SPDX-License-Identifier: Apache-2.0
// GPIO ports with alternate functions and the levels of the pins. RM0402 chapter "General-purpose I/Os" and RM0440
// chapter of the same name, whose port has BRR besides; reset values of the SVDs: PA13, PA14, PA15, PB3 and PB4 belong
// to the debug port (AF0).
#pragma once

#include "sim_host/emulator/peripheral.hpp"
#include "sim_host/emulator/pin_functions.hpp"

#include <array>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace tetap::board {

/// A port's place and its registers after reset.
struct GpioPortLayout {
  char letter;
  std::uint32_t base, moder, ospeedr, pupdr;
};

class GpioPort final : public Peripheral {
 public:
  GpioPort(Surroundings around, const GpioPortLayout& layout, std::function<void(Pin)> on_change);

  std::uint32_t read(std::uint32_t offset) override;
  void write(std::uint32_t offset, std::uint32_t value, std::uint32_t mask) override;
  void reset() override;

  enum class Mode : std::uint8_t { kInput, kOutput, kAlternate, kAnalog };
  [[nodiscard]] Mode mode(int pin) const { return static_cast<Mode>(moder_ >> 2 * pin & 3); }
  [[nodiscard]] int alternate(int pin) const;
  /// Level at the pin: the output, else what drives it from outside, else the pull resistor, else low.
  [[nodiscard]] bool level(int pin) const;
  /// A chip outside drives the pin; empty: it floats.
  void drive(int pin, std::optional<bool> level);

 private:
  void write_outputs(std::uint32_t odr);
  void changed(std::uint32_t pins);

  GpioPortLayout layout_;
  std::function<void(Pin)> on_change_;
  std::uint32_t moder_ = 0, otyper_ = 0, ospeedr_ = 0, pupdr_ = 0, odr_ = 0;
  std::array<std::uint32_t, 2> afr_{};
  std::array<std::optional<bool>, 16> driven_{};
};

/// All pins: who is connected to which signal, and who wants to know of changes.
class Pins {
 public:
  Pins(Surroundings around, std::span<const GpioPortLayout> ports, std::span<const PinFunction> functions);

  [[nodiscard]] GpioPort& port(char letter) { return *ports_[static_cast<std::size_t>(letter - 'A')]; }
  [[nodiscard]] const GpioPort& port(char letter) const { return *ports_[static_cast<std::size_t>(letter - 'A')]; }

  [[nodiscard]] bool level(Pin pin) const { return port(pin.port).level(pin.number); }
  void drive(Pin pin, std::optional<bool> level) { port(pin.port).drive(pin.number, level); }
  /// Whether `pin` is set to the alternate function that carries `signal`.
  [[nodiscard]] bool carries(Pin pin, Signal signal) const;
  /// The mode of a pin in words, for complaints: "PA15 is alternate function 0".
  [[nodiscard]] std::string describe(Pin pin) const;
  /// `action` runs after each change of the level of `pin`.
  void watch(Pin pin, std::function<void(bool)> action) { watchers_[pin].push_back({std::move(action), level(pin)}); }
  /// `action` runs after each change of any pin's level.
  void watch_all(std::function<void(Pin, bool)> action) { all_.push_back(std::move(action)); }

 private:
  struct Watcher {
    std::function<void(bool)> action;
    bool last;
  };
  void changed(Pin pin);

  std::span<const PinFunction> functions_;
  std::vector<std::unique_ptr<GpioPort>> ports_;  ///< from A on
  std::map<Pin, std::vector<Watcher>> watchers_;
  std::map<Pin, bool> last_;
  std::vector<std::function<void(Pin, bool)>> all_;
};

}  // namespace tetap::board
