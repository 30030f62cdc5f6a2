// SPDX-License-Identifier: Apache-2.0
// Blocks of an STM32F412 or F405 as WiredBoard uses them. Both chips have them at the same addresses.
#pragma once

#include "hal/chip/arm/interrupt_lock.hpp"
#include "hal/chip/arm/systick_clock.hpp"
#include "hal/chip/stm32/boot_cause.hpp"
#include "hal/chip/stm32/can_controller.hpp"
#include "hal/chip/stm32/flash_cells.hpp"
#include "hal/chip/stm32/flash_storage_f4.hpp"
#include "hal/chip/stm32/gpio.hpp"
#include "hal/chip/stm32/peripheral_clocks.hpp"
#include "hal/chip/stm32/pll_plan_f4.hpp"
#include "hal/chip/stm32/serial_port.hpp"
#include "hal/chip/stm32/spi_master.hpp"
#include "hal/chip/support/mmio.hpp"

#include <cstdint>

namespace tetap::hal::stm32 {

struct F4Chip {
  using Can = CanController<Mmio, SysTickClock<Mmio>, InterruptLock>;
  using Dma = DmaStream<Mmio>;
  using SpiData = SpiDataOfF4;
  using Usart = UsartOfF4;
  using Storage = FlashStorageF4<Mmio, FlashCells>;

  static constexpr std::uint32_t kRcc = stm32f412::rcc::kRcc, kPwr = stm32f412::pwr::kPwr,
                                 kFlash = stm32f412::flash::kFlash, kIwdg = stm32f412::iwdg::kIwdg,
                                 kUsart1 = stm32f412::usart::kUsart1, kUsart2 = stm32f412::usart::kUsart2,
                                 kSpi1 = stm32f412::spi::kSpi1, kTim2 = stm32f412::tim::kTim2,
                                 kTim3 = stm32f412::tim::kTim3;
  static constexpr int kCanTransmit = stm32f412::interrupt::kCan1Tx, kCanReceive = stm32f412::interrupt::kCan1Rx0,
                       kGnssErrors = stm32f412::interrupt::kUsart1, kGnssDma = stm32f412::interrupt::kDma2Stream5;
  static constexpr ResetFlags kResetFlags = kResetFlagsF4;
  static constexpr CanTimingLimits kCanTimingLimits{};
  /// USART1's places on DMA2: RM0402, table "DMA2 request mapping".
  static constexpr std::uint32_t kReceiveStream = 5, kTransmitStream = 7, kUsart1Channel = 4;
  static constexpr Dma kGnssReceive{Mmio{stm32f412::dma::kDma2}, kReceiveStream, kUsart1Channel},
      kGnssTransmit{Mmio{stm32f412::dma::kDma2}, kTransmitStream, kUsart1Channel};

  static constexpr Pin pa(std::uint8_t number) { return {stm32f412::gpio::kGpioa, number}; }
  static constexpr Pin pb(std::uint8_t number) { return {stm32f412::gpio::kGpiob, number}; }
  static constexpr Pin pc(std::uint8_t number) { return {stm32f412::gpio::kGpioc, number}; }
  static Can can(const SysTickClock<Mmio>& clock) { return Can{Mmio{stm32f412::can::kCan1}, clock}; }
  static Storage storage() { return Storage{Mmio{kFlash}, kept_cells()}; }

  /// SYSCFG stays off: no pin interrupts.
  static void power_blocks() {
    namespace rcc = stm32f412::rcc;
    constexpr Mmio kBlock{kRcc};
    start(kBlock, {.enable_offset = rcc::ahb1enr::kOffset,
                   .enabled = rcc::ahb1enr::kGpioaen.mask() | rcc::ahb1enr::kGpioben.mask() |
                              rcc::ahb1enr::kGpiocen.mask() | rcc::ahb1enr::kDma2en.mask(),
                   .reset_offset = rcc::ahb1rstr::kOffset,
                   .reset = rcc::ahb1rstr::kDma2rst.mask()});
    start(kBlock, {.enable_offset = rcc::apb1enr::kOffset,
                   .enabled = rcc::apb1enr::kTim2en.mask() | rcc::apb1enr::kTim3en.mask() |
                              rcc::apb1enr::kUsart2en.mask() | rcc::apb1enr::kCan1en.mask(),
                   .reset_offset = rcc::apb1rstr::kOffset,
                   .reset = rcc::apb1rstr::kTim2rst.mask() | rcc::apb1rstr::kTim3rst.mask() |
                            rcc::apb1rstr::kUart2rst.mask() | rcc::apb1rstr::kCan1rst.mask()});
    start(kBlock, {.enable_offset = rcc::apb2enr::kOffset,
                   .enabled = rcc::apb2enr::kSpi1en.mask() | rcc::apb2enr::kUsart1en.mask(),
                   .reset_offset = rcc::apb2rstr::kOffset,
                   .reset = rcc::apb2rstr::kSpi1rst.mask() | rcc::apb2rstr::kUsart1rst.mask()});
  }
};

}  // namespace tetap::hal::stm32
