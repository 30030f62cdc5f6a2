// SPDX-License-Identifier: Apache-2.0
// The STM32F412CG without its core: blocks, bus, clocks, interrupts.
#pragma once

#include "sim_host/emulator/can.hpp"
#include "sim_host/emulator/chip.hpp"
#include "sim_host/emulator/dma.hpp"
#include "sim_host/emulator/encoder_timer.hpp"
#include "sim_host/emulator/exti.hpp"
#include "sim_host/emulator/flash_f4.hpp"
#include "sim_host/emulator/gpio.hpp"
#include "sim_host/emulator/iwdg.hpp"
#include "sim_host/emulator/rcc.hpp"
#include "sim_host/emulator/spi.hpp"
#include "sim_host/emulator/usart.hpp"

namespace tetap::board {

class Stm32f412 final : public Chip {
 public:
  explicit Stm32f412(const Oscillators& oscillators = {});

  // In the order in which they are made.
  Pwr pwr;
  FlashF4 flash;
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

  [[nodiscard]] ClockController& clocks() override { return rcc; }
  [[nodiscard]] CanLine& can_line() override { return can1.line; }
  [[nodiscard]] Spi& spi() override { return spi1; }
  [[nodiscard]] Iwdg& watchdog() override { return iwdg; }
  [[nodiscard]] FlashController& flash_controller() override { return flash; }

 private:
  void add_blocks();
  void connect();
};

}  // namespace tetap::board
