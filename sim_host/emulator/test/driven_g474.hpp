// SPDX-License-Identifier: Apache-2.0
// A Nucleo-G474RE that a test drives by its registers, without a core: clocks as a port would set them, pins, waiting.
#pragma once

#include "sim_host/emulator/nucleo_g474re.hpp"
#include "sim_host/emulator/registers_stm32g474.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <utility>

namespace tetap::board {

namespace g4 = hal::stm32g474_model;

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
    set(r::kRcc, r::rcc_ahb1enr::kOffset, 7);
    set(r::kRcc, r::rcc_ahb2enr::kOffset, 7);
    set(r::kRcc, r::rcc_apb1enr1::kOffset,
        r::rcc_apb1enr1::kTim2en.mask() | r::rcc_apb1enr1::kTim3en.mask() | r::rcc_apb1enr1::kUsart2en.mask() |
            r::rcc_apb1enr1::kFdcanen.mask() | r::rcc_apb1enr1::kPwren.mask());
    set(r::kRcc, r::rcc_apb2enr::kOffset,
        r::rcc_apb2enr::kSyscfgen.mask() | r::rcc_apb2enr::kSpi1en.mask() | r::rcc_apb2enr::kUsart1en.mask());
  }
  /// PLL of 320 MHz from the crystal of 24 MHz, output R of 160 MHz.
  void start_pll() {
    namespace r = g4::rcc;
    set(r::kRcc, r::rcc_cr::kOffset, r::rcc_cr::kHseon.mask());
    chip.advance_us(3'000);
    put(r::kRcc, r::rcc_pllcfgr::kOffset,
        r::rcc_pllcfgr::kPllsrc(3) | r::rcc_pllcfgr::kPllm(5) | r::rcc_pllcfgr::kPlln(80) | r::rcc_pllcfgr::kPllren(1));
    set(r::kRcc, r::rcc_cr::kOffset, r::rcc_cr::kPllon.mask());
    chip.advance_us(100);
  }
  /// Boost, wait states, then the PLL behind an AHB divided by two for a microsecond.
  void start_clocks(std::uint32_t latency = 4) {
    namespace r = g4::rcc;
    open_gates();
    put(g4::pwr::kPwr, g4::pwr::pwr_cr5::kOffset, 0);
    put(g4::flash::kFlash, g4::flash::flash_acr::kOffset, 0x0004'0600 | latency);
    start_pll();
    put(r::kRcc, r::rcc_cfgr::kOffset, r::rcc_cfgr::kHpre(8) | r::rcc_cfgr::kSw(3));
    chip.advance_us(2);
    put(r::kRcc, r::rcc_cfgr::kOffset, r::rcc_cfgr::kSw(3));
    put(r::kRcc, r::rcc_ccipr::kOffset, r::rcc_ccipr::kFdcansel(2));
  }
  [[nodiscard]] bool pending(int interrupt) const { return chip.nvic.pending(exception::kInterrupt0 + interrupt); }
  [[nodiscard]] bool complained(const char* model, const char* part) const { return chip.complaints.has(model, part); }
};

#ifndef EXPECT_NO_COMPLAINTS
#define EXPECT_NO_COMPLAINTS(board) EXPECT_TRUE((board).chip.complaints.empty()) << (board).chip.complaints.text()
#endif

}  // namespace tetap::board
