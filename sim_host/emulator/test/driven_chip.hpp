// SPDX-License-Identifier: Apache-2.0
// A board that a test drives by its registers, without a core: clocks as a port would set them, pins, waiting.
#pragma once

#include "hal/chip/stm32/registers_stm32f412.hpp"
#include "sim_host/emulator/ark_cannode.hpp"

#include <gtest/gtest.h>

#include <cstdint>

namespace tetap::board {

namespace reg = hal::stm32f412;

class DrivenChip : public ArkCannode {
 public:
  explicit DrivenChip(const BoardOptions& options = {}, SensorWorld world = {})
      : ArkCannode(options, std::move(world)) {}

  [[nodiscard]] std::uint32_t get(std::uint32_t base, std::uint32_t offset) { return chip.word(base + offset); }
  void put(std::uint32_t base, std::uint32_t offset, std::uint32_t value) { chip.set_word(base + offset, value); }
  void set(std::uint32_t base, std::uint32_t offset, std::uint32_t mask) {
    put(base, offset, get(base, offset) | mask);
  }
  void clear(std::uint32_t base, std::uint32_t offset, std::uint32_t mask) {
    put(base, offset, get(base, offset) & ~mask);
  }
  void alternate(Pin pin, std::uint32_t function) {
    const std::uint32_t base = chip.pins.port(pin.port).base();
    const auto number = static_cast<std::uint32_t>(pin.number);
    const std::uint32_t afr = number < 8 ? reg::gpio::afrl::kOffset : reg::gpio::afrh::kOffset,
                        shift = 4 * (number % 8);
    put(base, afr, (get(base, afr) & ~(0xFU << shift)) | function << shift);
    mode(pin, 2);
  }
  void mode(Pin pin, std::uint32_t value) {
    const std::uint32_t base = chip.pins.port(pin.port).base(), shift = 2 * static_cast<std::uint32_t>(pin.number);
    put(base, reg::gpio::moder::kOffset, (get(base, reg::gpio::moder::kOffset) & ~(3U << shift)) | value << shift);
  }
  void level(Pin pin, bool high) {
    put(chip.pins.port(pin.port).base(), reg::gpio::bsrr::kOffset, 1U << (pin.number + (high ? 0 : 16)));
  }
  /// All blocks clocked, 96 MHz from the crystal, APB1 at 48 MHz.
  void start_clocks() {
    put(reg::rcc::kRcc, reg::rcc::ahb1enr::kOffset, 0x0060'0007);
    put(reg::rcc::kRcc, reg::rcc::apb1enr::kOffset, 0x1202'4003);
    put(reg::rcc::kRcc, reg::rcc::apb2enr::kOffset, 0x0000'5010);
    put(reg::pwr::kPwr, reg::pwr::cr::kOffset, reg::pwr::cr::kVos(3));
    set(reg::rcc::kRcc, reg::rcc::cr::kOffset, reg::rcc::cr::kHseon.mask());
    chip.advance_us(3'000);
    put(reg::rcc::kRcc, reg::rcc::pllcfgr::kOffset,
        reg::rcc::pllcfgr::kPllm(8) | reg::rcc::pllcfgr::kPlln(384) | reg::rcc::pllcfgr::kPllp(1) |
            reg::rcc::pllcfgr::kPllsrc(1) | reg::rcc::pllcfgr::kPllq(8));
    set(reg::rcc::kRcc, reg::rcc::cr::kOffset, reg::rcc::cr::kPllon.mask());
    put(reg::flash::kFlash, reg::flash::acr::kOffset, reg::flash::acr::kLatency(3));
    chip.advance_us(300);
    put(reg::rcc::kRcc, reg::rcc::cfgr::kOffset, reg::rcc::cfgr::kPpre1(4) | reg::rcc::cfgr::kSw(2));
  }
  [[nodiscard]] bool pending(int interrupt) const { return chip.nvic.pending(exception::kInterrupt0 + interrupt); }
  [[nodiscard]] bool complained(const char* model, const char* part) const { return chip.complaints.has(model, part); }
};

#define EXPECT_NO_COMPLAINTS(board) EXPECT_TRUE((board).chip.complaints.empty()) << (board).chip.complaints.text()

}  // namespace tetap::board
