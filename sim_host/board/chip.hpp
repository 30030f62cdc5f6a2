// SPDX-License-Identifier: Apache-2.0
// The STM32F412CG without its core: blocks, bus, clocks, interrupts. A test drives it by read(), write() and advance();
// the machine executes an image on it.
#pragma once

#include "sim_host/board/can.hpp"
#include "sim_host/board/dma.hpp"
#include "sim_host/board/encoder_timer.hpp"
#include "sim_host/board/exti.hpp"
#include "sim_host/board/gpio.hpp"
#include "sim_host/board/iwdg.hpp"
#include "sim_host/board/memory.hpp"
#include "sim_host/board/nvic.hpp"
#include "sim_host/board/rcc.hpp"
#include "sim_host/board/spi.hpp"
#include "sim_host/board/system_control.hpp"
#include "sim_host/board/usart.hpp"

#include <array>
#include <cstdint>
#include <optional>

namespace tetap::board {

class Chip {
 public:
  explicit Chip(const Oscillators& oscillators = {});
  Chip(const Chip&) = delete;
  Chip& operator=(const Chip&) = delete;

  // In the order in which they are made.
  Scheduler scheduler;
  Complaints complaints{scheduler};
  CoreClock clock;
  Nvic nvic;
  Memory memory;

 private:
  Surroundings around_{scheduler, complaints, nvic};

 public:
  SystemControl core;
  Pwr pwr;
  FlashInterface flash;
  Rcc rcc;
  Pins pins;
  Syscfg syscfg;
  Exti exti;
  Dma dma1, dma2;
  Usart usart1, usart2;
  Spi spi1, spi2;
  EncoderTimer tim2, tim3;
  Can can1;
  Iwdg iwdg;

  /// Register access of the core or of a test; `size` 1, 2 or 4 bytes. A place without a block reads 0 and is a
  /// complaint; the result is false.
  bool read(std::uint32_t address, int size, std::uint32_t& value);
  bool write(std::uint32_t address, int size, std::uint32_t value);

  /// Register words, for tests.
  [[nodiscard]] std::uint32_t word(std::uint32_t address) {
    std::uint32_t value = 0;
    (void)read(address, 4, value);
    return value;
  }
  void set_word(std::uint32_t address, std::uint32_t value) { (void)write(address, 4, value); }
  void advance_us(std::int64_t us) { scheduler.advance(scheduler.now() + us * kMicrosecond); }

  /// All blocks as after a system reset; SRAM keeps what it holds.
  void system_reset(ResetCause cause);
  /// A reset was asked for by software or watchdog and waits for the machine.
  std::optional<ResetCause> pending_reset;

 private:
  Peripheral* find(std::uint32_t address);
  void add_blocks();
  void connect();
  bool check(const Peripheral& block, std::uint32_t address, int size, const char* verb);

  std::array<Peripheral*, 512> map_{};  ///< by address - 0x40000000, 1 KiB each
};

}  // namespace tetap::board
