// SPDX-License-Identifier: Apache-2.0
// The STM32G474RE without its core: blocks, bus, clocks, interrupts. RM0440; registers_stm32g474.hpp is made of ST's
// SVD.
#pragma once

#include "sim_host/emulator/chip.hpp"
#include "sim_host/emulator/dma_g4.hpp"
#include "sim_host/emulator/encoder_timer.hpp"
#include "sim_host/emulator/exti.hpp"
#include "sim_host/emulator/fdcan.hpp"
#include "sim_host/emulator/flash_g4.hpp"
#include "sim_host/emulator/gpio.hpp"
#include "sim_host/emulator/iwdg.hpp"
#include "sim_host/emulator/rcc_g4.hpp"
#include "sim_host/emulator/spi_g4.hpp"
#include "sim_host/emulator/usart_g4.hpp"

namespace tetap::board {

/// Pins that a board connects.
struct Stm32g474Pins {
  Pin usart1_tx, usart1_rx, usart2_tx, usart2_rx, spi1_sck, spi1_miso, spi1_mosi, tim2_ch1, tim2_ch2, tim3_ch1,
      tim3_ch2;
  Fdcan::Wiring fdcan1;
};

class Stm32g474 final : public Chip {
 public:
  Stm32g474(const Oscillators& oscillators, const Stm32g474Pins& wired);

  // In the order in which they are made.
  PwrG4 pwr;
  FlashG4 flash;
  RccG4 rcc;
  Pins pins;
  Syscfg syscfg;
  Exti exti;
  Dmamux dmamux;
  DmaG4 dma1, dma2;
  UsartG4 usart1, usart2;
  SpiG4 spi1;
  EncoderTimer tim2, tim3;
  FdcanRam fdcan_ram;
  Fdcan fdcan1;
  Iwdg iwdg;

  [[nodiscard]] ClockController& clocks() override { return rcc; }
  [[nodiscard]] CanLine& can_line() override { return fdcan1.line; }
  [[nodiscard]] Spi& spi() override { return spi1; }
  [[nodiscard]] Iwdg& watchdog() override { return iwdg; }
  [[nodiscard]] FlashController& flash_controller() override { return flash; }

 private:
  [[nodiscard]] bool serve(DmaRequest request) { return dma1.serve(request) || dma2.serve(request); }
  void add_blocks();
  void connect();
};

}  // namespace tetap::board
