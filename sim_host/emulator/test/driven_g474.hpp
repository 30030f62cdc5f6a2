// SPDX-License-Identifier: Apache-2.0
// A Nucleo-G474RE that a test drives by its registers, without a core: clocks as a port would set them, pins, waiting.
#pragma once

#include "hal/chip/stm32/registers_stm32g474.hpp"
#include "sim_host/emulator/nucleo_g474re.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <utility>

namespace tetap::board {

namespace g4 = hal::stm32g474;

class DrivenG474 : public NucleoG474re {
 public:
  explicit DrivenG474(const BoardOptions& options = {}, SensorWorld world = {})
      : NucleoG474re(options, std::move(world)) {}

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
    const std::uint32_t afr = number < 8 ? g4::gpio::afrl::kOffset : g4::gpio::afrh::kOffset, shift = 4 * (number % 8);
    put(base, afr, (get(base, afr) & ~(0xFU << shift)) | function << shift);
    mode(pin, 2);
  }
  void mode(Pin pin, std::uint32_t value) {
    const std::uint32_t base = chip.pins.port(pin.port).base(), shift = 2 * static_cast<std::uint32_t>(pin.number);
    put(base, g4::gpio::moder::kOffset, (get(base, g4::gpio::moder::kOffset) & ~(3U << shift)) | value << shift);
  }
  void level(Pin pin, bool high) {
    put(chip.pins.port(pin.port).base(), g4::gpio::bsrr::kOffset, 1U << (pin.number + (high ? 0 : 16)));
  }
  /// All modelled blocks get their clocks.
  void open_gates() {
    namespace r = g4::rcc;
    set(r::kRcc, r::ahb1enr::kOffset, 7);
    set(r::kRcc, r::ahb2enr::kOffset, 7);
    set(r::kRcc, r::apb1enr1::kOffset,
        r::apb1enr1::kTim2en.mask() | r::apb1enr1::kTim3en.mask() | r::apb1enr1::kUsart2en.mask() |
            r::apb1enr1::kFdcanen.mask() | r::apb1enr1::kPwren.mask());
    set(r::kRcc, r::apb2enr::kOffset,
        r::apb2enr::kSyscfgen.mask() | r::apb2enr::kSpi1en.mask() | r::apb2enr::kUsart1en.mask());
  }
  /// PLL of 320 MHz from the crystal of 24 MHz, output R of 160 MHz.
  void start_pll() {
    namespace r = g4::rcc;
    set(r::kRcc, r::cr::kOffset, r::cr::kHseon.mask());
    chip.advance_us(3'000);
    put(r::kRcc, r::pllcfgr::kOffset,
        r::pllcfgr::kPllsrc(3) | r::pllcfgr::kPllm(5) | r::pllcfgr::kPlln(80) | r::pllcfgr::kPllren(1));
    set(r::kRcc, r::cr::kOffset, r::cr::kPllon.mask());
    chip.advance_us(100);
  }
  /// Boost, wait states, then the PLL behind an AHB divided by two for a microsecond.
  void start_clocks(std::uint32_t latency = 4) {
    namespace r = g4::rcc;
    open_gates();
    put(g4::pwr::kPwr, g4::pwr::cr5::kOffset, 0);
    put(g4::flash::kFlash, g4::flash::acr::kOffset, 0x0004'0600 | latency);
    start_pll();
    put(r::kRcc, r::cfgr::kOffset, r::cfgr::kHpre(8) | r::cfgr::kSw(3));
    chip.advance_us(2);
    put(r::kRcc, r::cfgr::kOffset, r::cfgr::kSw(3));
    put(r::kRcc, r::ccipr::kOffset, r::ccipr::kFdcansel(2));
  }
  [[nodiscard]] bool pending(int interrupt) const { return chip.nvic.pending(exception::kInterrupt0 + interrupt); }
  [[nodiscard]] bool complained(const char* model, const char* part) const { return chip.complaints.has(model, part); }
};

#ifndef EXPECT_NO_COMPLAINTS
#define EXPECT_NO_COMPLAINTS(board) EXPECT_TRUE((board).chip.complaints.empty()) << (board).chip.complaints.text()
#endif

}  // namespace tetap::board
