// SPDX-License-Identifier: Apache-2.0
// The STM32F412CG without its core: blocks, bus, clocks, interrupts.
#pragma once

#include "sim_host/board/can.hpp"
#include "sim_host/board/chip.hpp"
#include "sim_host/board/dma.hpp"
#include "sim_host/board/encoder_timer.hpp"
#include "sim_host/board/exti.hpp"
#include "sim_host/board/gpio.hpp"
#include "sim_host/board/iwdg.hpp"
#include "sim_host/board/rcc.hpp"
#include "sim_host/board/spi.hpp"
#include "sim_host/board/usart.hpp"

namespace tetap::board {

class Stm32f412 final : public Chip {
 public:
  explicit Stm32f412(const Oscillators& oscillators = {});

  // In the order in which they are made.
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

  [[nodiscard]] ClockController& clocks() override { return rcc; }
  [[nodiscard]] CanLine& can_line() override { return can1.line; }
  [[nodiscard]] Spi& spi() override { return spi1; }
  [[nodiscard]] Iwdg& watchdog() override { return iwdg; }

 private:
  void add_blocks();
  void connect();
};

}  // namespace tetap::board
