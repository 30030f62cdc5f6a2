// SPDX-License-Identifier: Apache-2.0
#include "sim_host/emulator/exti.hpp"

#include "hal/chip/stm32/registers_stm32f412.hpp"

namespace tetap::board {

namespace reg = hal::stm32f412;

Syscfg::Syscfg(Surroundings around, std::uint32_t base) : Peripheral(around, "SYSCFG", base, kBytes) {}

std::uint32_t Syscfg::read(std::uint32_t offset) {
  const std::uint32_t index = (offset - reg::syscfg::exticrx::kOffset) / 4;
  return index < 4 ? exticr_[index] : 0;
}

void Syscfg::write(std::uint32_t offset, std::uint32_t value, std::uint32_t mask) {
  const std::uint32_t index = (offset - reg::syscfg::exticrx::kOffset) / 4;
  if (index < 4) merge(exticr_[index], value & 0xFFFF, mask);
}

char Syscfg::port_of(int line) const {
  return static_cast<char>('A' + (exticr_[static_cast<std::size_t>(line / 4)] >> 4 * (line % 4) & 0xF));
}

Exti::Exti(Surroundings around, Pins& pins, const Syscfg& syscfg, const Layout& layout)
    : Peripheral(around, "EXTI", layout.base, kWords), syscfg_(syscfg), layout_(layout), imr_(layout.imr_reset) {
  pins.watch_all([this](Pin pin, bool level) { edge(pin, level); });
}

void Exti::reset() {
  emr_ = rtsr_ = ftsr_ = swier_ = pr_ = 0;
  imr_ = layout_.imr_reset;
  update();
}

void Exti::edge(Pin pin, bool level) {
  if (syscfg_.port_of(pin.number) != pin.port) return;
  if (((level ? rtsr_ : ftsr_) >> pin.number & 1) == 0) return;
  if ((imr_ >> pin.number & 1) != 0) pr_ |= 1U << pin.number;
  update();
}

void Exti::update() {
  constexpr int kSingle[] = {reg::interrupt::kExti0, reg::interrupt::kExti1, reg::interrupt::kExti2,
                             reg::interrupt::kExti3, reg::interrupt::kExti4};
  const std::uint32_t lines = pr_ & imr_;
  for (int i = 0; i < 5; ++i) set_interrupt(kSingle[i], (lines >> i & 1) != 0);
  set_interrupt(reg::interrupt::kExti95, (lines & 0x03E0) != 0);
  set_interrupt(reg::interrupt::kExti1510, (lines & 0xFC00) != 0);
}

std::uint32_t Exti::read(std::uint32_t offset) {
  switch (offset) {
    case reg::exti::imr::kOffset:
      return imr_;
    case reg::exti::emr::kOffset:
      return emr_;
    case reg::exti::rtsr::kOffset:
      return rtsr_;
    case reg::exti::ftsr::kOffset:
      return ftsr_;
    case reg::exti::swier::kOffset:
      return swier_;
    case reg::exti::pr::kOffset:
      return pr_;
    default:
      return 0;
  }
}

void Exti::write(std::uint32_t offset, std::uint32_t value, std::uint32_t mask) {
  value &= mask & layout_.lines;
  switch (offset) {
    case reg::exti::imr::kOffset:
      imr_ = value;
      break;
    case reg::exti::emr::kOffset:
      emr_ = value;
      break;
    case reg::exti::rtsr::kOffset:
      rtsr_ = value;
      break;
    case reg::exti::ftsr::kOffset:
      ftsr_ = value;
      break;
    case reg::exti::swier::kOffset:
      pr_ |= value & ~swier_ & imr_;
      swier_ |= value;
      break;
    case reg::exti::pr::kOffset:  // written with 1 to clear, SWIER with it
      pr_ &= ~value;
      swier_ &= ~value;
      break;
    default:
      break;
  }
  update();
}

}  // namespace tetap::board
