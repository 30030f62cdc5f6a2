// SPDX-License-Identifier: Apache-2.0
// Blocks of an STM32G474 as WiredBoard uses them.
#pragma once

#include "hal/chip/arm/interrupt_lock.hpp"
#include "hal/chip/arm/systick_clock.hpp"
#include "hal/chip/stm32/boot_cause.hpp"
#include "hal/chip/stm32/dma_channel.hpp"
#include "hal/chip/stm32/fdcan_controller.hpp"
#include "hal/chip/stm32/flash_cells.hpp"
#include "hal/chip/stm32/flash_ecc_trap.hpp"
#include "hal/chip/stm32/flash_storage_g4.hpp"
#include "hal/chip/stm32/gpio.hpp"
#include "hal/chip/stm32/peripheral_clocks.hpp"
#include "hal/chip/stm32/pll_plan_g4.hpp"
#include "hal/chip/stm32/spi_master.hpp"
#include "hal/chip/support/mmio.hpp"

#include <cstdint>

namespace tetap::hal::stm32 {

struct G4Chip {
  using Can = FdcanController<Mmio, SysTickClock<Mmio>, InterruptLock>;
  using Dma = DmaChannel<Mmio>;
  using SpiData = SpiDataOfG4;
  using Usart = UsartOfG4;
  using Storage = FlashStorageG4<Mmio, FlashCells, FlashEccTrap>;

  static constexpr std::uint32_t kRcc = stm32g474::rcc::kRcc, kPwr = stm32g474::pwr::kPwr,
                                 kFlash = stm32g474::flash::kFlash, kIwdg = stm32g474::iwdg::kIwdg,
                                 kUsart1 = stm32g474::usart::kUsart1, kUsart2 = stm32g474::usart::kUsart2,
                                 kSpi1 = stm32g474::spi::kSpi1, kTim2 = stm32g474::tim::kTim2,
                                 kTim3 = stm32g474::tim::kTim3;
  static constexpr int kCanTransmit = stm32g474::interrupt::kFdcan1It1, kCanReceive = stm32g474::interrupt::kFdcan1It0,
                       kGnssErrors = stm32g474::interrupt::kUsart1, kGnssDma = stm32g474::interrupt::kDma1Ch1;
  static constexpr ResetFlags kResetFlags = kResetFlagsG4;
  static constexpr CanTimingLimits kCanTimingLimits = kFdcanTimingLimits;
  /// Channels 1 and 2 of DMA1, counted from 0, and USART1's requests: RM0440, table "DMAMUX: assignment of multiplexer
  /// inputs to resources".
  static constexpr std::uint32_t kReceiveChannel = 0, kTransmitChannel = 1, kUsart1Receives = 24, kUsart1Sends = 25;
  static constexpr Dma kGnssReceive{Mmio{stm32g474::dma::kDma1}, Mmio{stm32g474::dmamux::kDmamux}, kReceiveChannel,
                                    kUsart1Receives},
      kGnssTransmit{Mmio{stm32g474::dma::kDma1}, Mmio{stm32g474::dmamux::kDmamux}, kTransmitChannel, kUsart1Sends};

  static constexpr Pin pa(std::uint8_t number) { return {stm32g474::gpio::kGpioa, number}; }
  static constexpr Pin pb(std::uint8_t number) { return {stm32g474::gpio::kGpiob, number}; }
  static constexpr Pin pc(std::uint8_t number) { return {stm32g474::gpio::kGpioc, number}; }
  static Can can(const SysTickClock<Mmio>& clock) {
    return Can{Mmio{stm32g474::fdcan::kFdcan1}, Mmio{stm32g474::fdcan::kFdcan}, clock};
  }

  static Storage storage() { return Storage{Mmio{kFlash}, kept_cells()}; }

  /// SYSCFG stays off: no pin interrupts.
  static void power_blocks() {
    namespace rcc = stm32g474::rcc;
    constexpr Mmio kBlock{kRcc};
    set_bits(kBlock, rcc::ahb2enr::kOffset,
             rcc::ahb2enr::kGpioaen.mask() | rcc::ahb2enr::kGpioben.mask() | rcc::ahb2enr::kGpiocen.mask());
    // FDCAN counts the clock of APB1, instead of the crystal's, which may be missing.
    constexpr std::uint32_t kFromApb1 = 2;
    set_bits(kBlock, rcc::ccipr::kOffset, rcc::ccipr::kFdcansel(kFromApb1));
    start(kBlock, {.enable_offset = rcc::ahb1enr::kOffset,
                   .enabled = rcc::ahb1enr::kDma1en.mask() | rcc::ahb1enr::kDmamux1en.mask(),
                   .reset_offset = rcc::ahb1rstr::kOffset,
                   .reset = rcc::ahb1rstr::kDma1rst.mask() | rcc::ahb1rstr::kDmamux1rst.mask()});
    start(kBlock, {.enable_offset = rcc::apb1enr1::kOffset,
                   .enabled = rcc::apb1enr1::kTim2en.mask() | rcc::apb1enr1::kTim3en.mask() |
                              rcc::apb1enr1::kUsart2en.mask() | rcc::apb1enr1::kFdcanen.mask(),
                   .reset_offset = rcc::apb1rstr1::kOffset,
                   .reset = rcc::apb1rstr1::kTim2rst.mask() | rcc::apb1rstr1::kTim3rst.mask() |
                            rcc::apb1rstr1::kUsart2rst.mask() | rcc::apb1rstr1::kFdcanrst.mask()});
    start(kBlock, {.enable_offset = rcc::apb2enr::kOffset,
                   .enabled = rcc::apb2enr::kSpi1en.mask() | rcc::apb2enr::kUsart1en.mask(),
                   .reset_offset = rcc::apb2rstr::kOffset,
                   .reset = rcc::apb2rstr::kSpi1rst.mask() | rcc::apb2rstr::kUsart1rst.mask()});
    // After a reset PB4 has the pull-down of a USB-C plug. The clock tree has enabled PWR.
    set_bits(Mmio{kPwr}, stm32g474::pwr::cr3::kOffset, stm32g474::pwr::cr3::kUcpd1Dbdis.mask());
  }
};

}  // namespace tetap::hal::stm32
