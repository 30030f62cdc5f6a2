// SPDX-License-Identifier: Apache-2.0
#include "sim_host/emulator/gpio.hpp"

#include "hal/chip/stm32/registers_stm32f412.hpp"

namespace tetap::board {

namespace reg = hal::stm32f412::gpio;

namespace {
constexpr std::uint32_t kBrr = 0x28;  // RM0440, GPIOx_BRR; reserved on the STM32F412
}

GpioPort::GpioPort(Surroundings around, const GpioPortLayout& layout, std::function<void(Pin)> on_change)
    : Peripheral(around, std::string("GPIO") + layout.letter, layout.base, kBytes),
      layout_(layout),
      on_change_(std::move(on_change)) {
  reset();
}

void GpioPort::reset() {
  moder_ = layout_.moder;
  ospeedr_ = layout_.ospeedr;
  pupdr_ = layout_.pupdr;
  otyper_ = odr_ = 0;
  afr_ = {};
  changed(0xFFFF);
}

int GpioPort::alternate(int pin) const {
  return static_cast<int>(afr_[static_cast<std::size_t>(pin / 8)] >> 4 * (pin % 8) & 0xF);
}

bool GpioPort::level(int pin) const {
  const auto& driven = driven_[static_cast<std::size_t>(pin)];
  const bool out = (odr_ >> pin & 1) != 0;
  const bool open_drain = (otyper_ >> pin & 1) != 0;
  if (mode(pin) == Mode::kOutput && !(open_drain && out)) return out;
  if (driven) return *driven;
  return (pupdr_ >> 2 * pin & 3) == 1;
}

void GpioPort::drive(int pin, std::optional<bool> level) {
  if (driven_[static_cast<std::size_t>(pin)] == level) return;
  driven_[static_cast<std::size_t>(pin)] = level;
  changed(1U << pin);
}

void GpioPort::changed(std::uint32_t pins) {
  for (int pin = 0; pin < 16; ++pin) {
    if ((pins >> pin & 1) == 0) continue;
    const auto& driven = driven_[static_cast<std::size_t>(pin)];
    if (mode(pin) == Mode::kOutput && driven && (otyper_ >> pin & 1) == 0) {
      complain(Pin{layout_.letter, pin}.name() + " is an output, but another chip drives it");
    }
    on_change_({layout_.letter, pin});
  }
}

std::uint32_t GpioPort::read(std::uint32_t offset) {
  switch (offset) {
    case reg::moder::kOffset:
      return moder_;
    case reg::otyper::kOffset:
      return otyper_;
    case reg::ospeedr::kOffset:
      return ospeedr_;
    case reg::pupdr::kOffset:
      return pupdr_;
    case reg::idr::kOffset: {
      std::uint32_t word = 0;
      for (int pin = 0; pin < 16; ++pin) {
        if (mode(pin) != Mode::kAnalog && level(pin)) word |= 1U << pin;
      }
      return word;
    }
    case reg::odr::kOffset:
      return odr_;
    case reg::afrl::kOffset:
      return afr_[0];
    case reg::afrh::kOffset:
      return afr_[1];
    default:
      return 0;
  }
}

void GpioPort::write_outputs(std::uint32_t odr) {
  const std::uint32_t flipped = odr_ ^ odr;
  odr_ = odr;
  changed(flipped);
}

void GpioPort::write(std::uint32_t offset, std::uint32_t value, std::uint32_t mask) {
  switch (offset) {
    case reg::moder::kOffset: {
      const std::uint32_t before = moder_;
      merge(moder_, value, mask);
      std::uint32_t pins = 0;
      for (int pin = 0; pin < 16; ++pin) pins |= (((before ^ moder_) >> 2 * pin & 3) != 0 ? 1U : 0U) << pin;
      return changed(pins);
    }
    case reg::otyper::kOffset:
      merge(otyper_, value & 0xFFFF, mask);
      return changed(0xFFFF);
    case reg::ospeedr::kOffset:
      return merge(ospeedr_, value, mask);
    case reg::pupdr::kOffset:
      merge(pupdr_, value, mask);
      return changed(0xFFFF);
    case reg::odr::kOffset: {
      std::uint32_t odr = odr_;
      merge(odr, value & 0xFFFF, mask);
      return write_outputs(odr);
    }
    case reg::bsrr::kOffset:  // set wins over reset
      return write_outputs((odr_ & ~((value & mask) >> 16)) | (value & mask & 0xFFFF));
    case reg::lckr::kOffset:
      return complain("LCKR is not modelled");
    case reg::afrl::kOffset:
      return merge(afr_[0], value, mask);
    case reg::afrh::kOffset:
      return merge(afr_[1], value, mask);
    case kBrr:
      return write_outputs(odr_ & ~(value & mask & 0xFFFF));
    default:
      return;
  }
}

Pins::Pins(Surroundings around, std::span<const GpioPortLayout> ports, std::span<const PinFunction> functions)
    : functions_(functions), ports_(ports.size()) {
  for (std::size_t i = 0; i < ports_.size(); ++i)
    ports_[i] = std::make_unique<GpioPort>(around, ports[i], [this](Pin pin) { changed(pin); });
}

bool Pins::carries(Pin pin, Signal signal) const {
  const GpioPort& at = port(pin.port);
  if (at.mode(pin.number) != GpioPort::Mode::kAlternate) return false;
  for (const PinFunction& one : functions_) {
    if (one.signal == signal && one.pin == pin) return at.alternate(pin.number) == one.alternate;
  }
  return false;
}

std::string Pins::describe(Pin pin) const {
  constexpr const char* kModes[] = {"an input", "an output", "alternate function ", "analog"};
  const GpioPort& at = port(pin.port);
  const GpioPort::Mode mode = at.mode(pin.number);
  return pin.name() + " is " + kModes[static_cast<int>(mode)] +
         (mode == GpioPort::Mode::kAlternate ? std::to_string(at.alternate(pin.number)) : "");
}

void Pins::changed(Pin pin) {
  if (!ports_[static_cast<std::size_t>(pin.port - 'A')]) return;  // under construction
  const bool now = level(pin);
  const auto known = last_.find(pin);
  if (known != last_.end() && known->second == now) return;
  last_[pin] = now;
  const auto found = watchers_.find(pin);
  if (found != watchers_.end()) {
    for (Watcher& one : found->second) {
      if (one.last == now) continue;
      one.last = now;
      one.action(now);
    }
  }
  for (const auto& action : all_) action(pin, now);
}

}  // namespace tetap::board
