// SPDX-License-Identifier: Apache-2.0
#include "sim_host/emulator/stm32g474.hpp"

#include "hal/chip/stm32/registers_stm32f412.hpp"
#include "hal/chip/stm32/registers_stm32g474.hpp"

#include <array>
#include <initializer_list>

namespace tetap::board {

namespace reg = hal::stm32g474;
namespace older = hal::stm32f412;

namespace {

// RM0440, sections "Memory organization" and "Embedded SRAM": SRAM1, SRAM2 and CCM SRAM follow each other; the core
// sees the last one at 0x1000 0000, too.
constexpr MemoryLayout kMemory{512U << 10, 128U << 10, 0x1000'0000, 32U << 10};
constexpr std::array kWindows = {BusWindow{0x4000'0000, 0x3'0000}, BusWindow{0x4800'0000, 0x2000}};
constexpr std::array kPorts = {
    GpioPortLayout{'A', reg::gpio::kGpioa, reg::gpio::moder::kResetValueGpioa, reg::gpio::ospeedr::kResetValueGpioa,
                   reg::gpio::pupdr::kResetValueGpioa},
    GpioPortLayout{'B', reg::gpio::kGpiob, reg::gpio::moder::kResetValueGpiob, reg::gpio::ospeedr::kResetValueGpiob,
                   reg::gpio::pupdr::kResetValueGpiob},
    GpioPortLayout{'C', reg::gpio::kGpioc, reg::gpio::moder::kResetValueGpioc, reg::gpio::ospeedr::kResetValueGpioc,
                   reg::gpio::pupdr::kResetValueGpioc}};
constexpr std::uint32_t kExtiLines = 0xE07D'FFFF;  // RM0440, EXTI_RTSR1: lines that an edge can set
constexpr Pin kDeadBattery{'B', 4};

// Blocks of the older chip serve here, as their registers lie at the same offsets.
static_assert(reg::gpio::moder::kOffset == older::gpio::moder::kOffset &&
              reg::gpio::idr::kOffset == older::gpio::idr::kOffset &&
              reg::gpio::bsrr::kOffset == older::gpio::bsrr::kOffset &&
              reg::gpio::afrh::kOffset == older::gpio::afrh::kOffset && reg::gpio::brr::kOffset == 0x28);
static_assert(reg::exti::imr1::kOffset == older::exti::imr::kOffset &&
              reg::exti::rtsr1::kOffset == older::exti::rtsr::kOffset &&
              reg::exti::ftsr1::kOffset == older::exti::ftsr::kOffset &&
              reg::exti::pr1::kOffset == older::exti::pr::kOffset &&
              reg::syscfg::exticrx::kOffset == older::syscfg::exticrx::kOffset);
static_assert(reg::interrupt::kExti0 == older::interrupt::kExti0 &&
              reg::interrupt::kExti1 == older::interrupt::kExti1 &&
              reg::interrupt::kExti2 == older::interrupt::kExti2 &&
              reg::interrupt::kExti3 == older::interrupt::kExti3 &&
              reg::interrupt::kExti4 == older::interrupt::kExti4 &&
              reg::interrupt::kExti95 == older::interrupt::kExti95 &&
              reg::interrupt::kExti1510 == older::interrupt::kExti1510);
static_assert(reg::tim::cr1::kOffset == older::tim::cr1::kOffset &&
              reg::tim::smcr::kOffset == older::tim::smcr::kOffset &&
              reg::tim::ccmr1::kOffset == older::tim::ccmr1_input::kOffset &&
              reg::tim::cnt::kOffset == older::tim::cnt::kOffset && reg::tim::arr::kOffset == older::tim::arr::kOffset);
static_assert(reg::iwdg::kr::kOffset == older::iwdg::kr::kOffset &&
              reg::iwdg::pr::kOffset == older::iwdg::pr::kOffset &&
              reg::iwdg::rlr::kOffset == older::iwdg::rlr::kOffset &&
              reg::iwdg::sr::kOffset == older::iwdg::sr::kOffset);

}  // namespace

Stm32g474::Stm32g474(const Oscillators& oscillators, const Stm32g474Pins& wired)
    : Chip(kMemory, kWindows),
      pwr(around_),
      flash(around_, memory, pwr),
      rcc(around_, oscillators, pwr, flash),
      pins(around_, kPorts, kStm32g474PinFunctions),
      syscfg(around_, reg::syscfg::kSyscfg),
      exti(around_, pins, syscfg, {reg::exti::kExti, kExtiLines, reg::exti::imr1::kResetValue & kExtiLines}),
      dmamux(around_),
      dma1(around_, 1, reg::dma::kDma1, memory, dmamux),
      dma2(around_, 2, reg::dma::kDma2, memory, dmamux),
      usart1(
          around_, "USART1", reg::usart::kUsart1, pins,
          {Signal::kUsart1Tx, Signal::kUsart1Rx, wired.usart1_tx, wired.usart1_rx, reg::interrupt::kUsart1,
           DmaRequest::kUsart1Tx, DmaRequest::kUsart1Rx},
          [this] { return rcc.usart1_hz(); }, [this](DmaRequest request) { return serve(request); }),
      usart2(
          around_, "USART2", reg::usart::kUsart2, pins,
          {Signal::kUsart2Tx, Signal::kUsart2Rx, wired.usart2_tx, wired.usart2_rx, reg::interrupt::kUsart2,
           DmaRequest::kUsart2Tx, DmaRequest::kUsart2Rx},
          [this] { return rcc.usart2_hz(); }, [this](DmaRequest request) { return serve(request); }),
      spi1(
          around_, "SPI1", reg::spi::kSpi1, pins,
          {Signal::kSpi1Sck, Signal::kSpi1Miso, Signal::kSpi1Mosi, wired.spi1_sck, wired.spi1_miso, wired.spi1_mosi,
           reg::interrupt::kSpi1, DmaRequest::kSpi1Tx, DmaRequest::kSpi1Rx},
          [this] { return rcc.apb2_hz(); }, [this](DmaRequest request) { return serve(request); }),
      tim2(around_, "TIM2", reg::tim::kTim2, pins,
           {Signal::kTim2Ch1, Signal::kTim2Ch2, wired.tim2_ch1, wired.tim2_ch2, reg::interrupt::kTim2, 32},
           [this] { return rcc.apb1_timer_hz(); }),
      tim3(around_, "TIM3", reg::tim::kTim3, pins,
           {Signal::kTim3Ch1, Signal::kTim3Ch2, wired.tim3_ch1, wired.tim3_ch2, reg::interrupt::kTim3, 16},
           [this] { return rcc.apb1_timer_hz(); }),
      fdcan_ram(around_, reg::fdcan::kFdcan),
      fdcan1(
          around_, fdcan_ram, pins, wired.fdcan1, [this] { return rcc.fdcan_hz(); }, [this] { return rcc.apb1_hz(); }),
      iwdg(around_, reg::iwdg::kIwdg, [this] { return rcc.lsi_hz(); }) {
  spi1.reset();
  add_blocks();
  connect();
  start();
  tim3.on_start = [this, ch1 = wired.tim3_ch1] {
    if (ch1 == kDeadBattery && pwr.dead_battery_pull_down())
      complaints.add("PWR", "PB4 counts with the pull-down of UCPD1: PWR_CR3.UCPD1_DBDIS is 0");
  };
}

void Stm32g474::add_blocks() {
  namespace r = reg::rcc;
  const auto ahb1 = [this](Peripheral& block, hal::Field enable, hal::Field reset) {
    rcc.add_block(block, r::ahb1enr::kOffset, enable.mask(), r::ahb1rstr::kOffset, reset.mask());
  };
  const auto ahb2 = [this](Peripheral& block, hal::Field enable, hal::Field reset) {
    rcc.add_block(block, r::ahb2enr::kOffset, enable.mask(), r::ahb2rstr::kOffset, reset.mask());
  };
  const auto apb1 = [this](Peripheral& block, hal::Field enable, hal::Field reset) {
    rcc.add_block(block, r::apb1enr1::kOffset, enable.mask(), r::apb1rstr1::kOffset, reset.mask());
  };
  const auto apb2 = [this](Peripheral& block, hal::Field enable, hal::Field reset) {
    rcc.add_block(block, r::apb2enr::kOffset, enable.mask(), r::apb2rstr::kOffset, reset.mask());
  };
  ahb1(dma1, r::ahb1enr::kDma1en, r::ahb1rstr::kDma1rst);
  ahb1(dma2, r::ahb1enr::kDma2en, r::ahb1rstr::kDma2rst);
  ahb1(dmamux, r::ahb1enr::kDmamux1en, r::ahb1rstr::kDmamux1rst);
  rcc.add_block(flash, r::ahb1enr::kOffset, r::ahb1enr::kFlashen.mask(), 0, 0);
  ahb2(pins.port('A'), r::ahb2enr::kGpioaen, r::ahb2rstr::kGpioarst);
  ahb2(pins.port('B'), r::ahb2enr::kGpioben, r::ahb2rstr::kGpiobrst);
  ahb2(pins.port('C'), r::ahb2enr::kGpiocen, r::ahb2rstr::kGpiocrst);
  apb1(tim2, r::apb1enr1::kTim2en, r::apb1rstr1::kTim2rst);
  apb1(tim3, r::apb1enr1::kTim3en, r::apb1rstr1::kTim3rst);
  apb1(usart2, r::apb1enr1::kUsart2en, r::apb1rstr1::kUsart2rst);
  apb1(fdcan1, r::apb1enr1::kFdcanen, r::apb1rstr1::kFdcanrst);
  apb1(fdcan_ram, r::apb1enr1::kFdcanen, r::apb1rstr1::kFdcanrst);
  apb1(pwr, r::apb1enr1::kPwren, r::apb1rstr1::kPwrrst);
  apb2(usart1, r::apb2enr::kUsart1en, r::apb2rstr::kUsart1rst);
  apb2(spi1, r::apb2enr::kSpi1en, r::apb2rstr::kSpi1rst);
  apb2(syscfg, r::apb2enr::kSyscfgen, r::apb2rstr::kSyscfgrst);
  const std::initializer_list<Peripheral*> all = {
      &rcc,  &pwr,  &flash,  &pins.port('A'), &pins.port('B'), &pins.port('C'), &syscfg, &exti,   &dmamux,
      &dma1, &dma2, &usart1, &usart2,         &spi1,           &tim2,           &tim3,   &fdcan1, &iwdg};
  for (Peripheral* block : all) place(*block);
  place(fdcan_ram, 0xC00);
}

void Stm32g474::connect() {
  for (DmaG4* dma : {&dma1, &dma2}) {
    dma->bus_read = [this](std::uint32_t address, int size) {
      std::uint32_t value = 0;
      (void)read(address, size, value);
      return value;
    };
    dma->bus_write = [this](std::uint32_t address, std::uint32_t value, int size) {
      (void)write(address, size, value);
    };
    dma->clocked = [this, dma] { return rcc.clocked(*dma) && rcc.clocked(dmamux); };
    dma->on_enable = [this] { usart1.raise_requests(), usart2.raise_requests(), spi1.raise_requests(); };
  }
  flash.on_change = [this] { rcc.check_limits(); };
  flash.on_nmi = [this] { nvic.pend(exception::kNmi); };
  pwr.on_change = [this] { rcc.check_limits(); };
  iwdg.on_expired = [this] { pending_reset = ResetCause::kWatchdog; };
}

}  // namespace tetap::board
