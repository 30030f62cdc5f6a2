// SPDX-License-Identifier: Apache-2.0
#include "sim_host/emulator/stm32f412.hpp"

#include "hal/chip/stm32/registers_stm32f412.hpp"

#include <array>
#include <initializer_list>

namespace tetap::board {

namespace reg = hal::stm32f412;

namespace {

// RM0402, table of the memory map: STM32F412xG.
constexpr MemoryLayout kMemory{1U << 20, 256U << 10};
constexpr std::array kWindows = {BusWindow{0x4000'0000, 0x8'0000}};
constexpr std::array kPorts = {
    GpioPortLayout{'A', reg::gpio::kGpioa, reg::gpio::moder::kResetValueGpioa, 0, reg::gpio::pupdr::kResetValueGpioa},
    GpioPortLayout{'B', reg::gpio::kGpiob, reg::gpio::moder::kResetValueGpiob, reg::gpio::ospeedr::kResetValueGpiob,
                   reg::gpio::pupdr::kResetValueGpiob},
    GpioPortLayout{'C', reg::gpio::kGpioc, reg::gpio::moder::kResetValueGpioc, 0, reg::gpio::pupdr::kResetValueGpioc}};
constexpr std::uint32_t kExtiLines = 0x007F'FFFF;

constexpr Usart::Wiring kUsart1{
    Signal::kUsart1Tx,     Signal::kUsart1Rx,    {'A', 15}, {'B', 3}, reg::interrupt::kUsart1,
    DmaRequest::kUsart1Tx, DmaRequest::kUsart1Rx};
constexpr Usart::Wiring kUsart2{
    Signal::kUsart2Tx,     Signal::kUsart2Rx,    {'A', 2}, {'A', 3}, reg::interrupt::kUsart2,
    DmaRequest::kUsart2Tx, DmaRequest::kUsart2Rx};
constexpr Spi::Wiring kSpi1{Signal::kSpi1Sck, Signal::kSpi1Miso,     Signal::kSpi1Mosi,   {'A', 5},           {'A', 6},
                            {'A', 7},         reg::interrupt::kSpi1, DmaRequest::kSpi1Tx, DmaRequest::kSpi1Rx};
constexpr Spi::Wiring kSpi2{Signal::kSpi2Sck, Signal::kSpi2Miso,     Signal::kSpi2Mosi,   {'B', 13},          {'B', 14},
                            {'B', 15},        reg::interrupt::kSpi2, DmaRequest::kSpi2Tx, DmaRequest::kSpi2Rx};
constexpr EncoderTimer::Wiring kTim2{Signal::kTim2Ch1, Signal::kTim2Ch2, {'A', 0}, {'A', 1}, reg::interrupt::kTim2, 32};
constexpr EncoderTimer::Wiring kTim3{Signal::kTim3Ch1, Signal::kTim3Ch2, {'B', 4}, {'B', 5}, reg::interrupt::kTim3, 16};

}  // namespace

Stm32f412::Stm32f412(const Oscillators& oscillators)
    : Chip(kMemory, kWindows),
      pwr(around_),
      flash(around_, memory),
      rcc(around_, oscillators, pwr, flash),
      pins(around_, kPorts, kStm32f412PinFunctions),
      syscfg(around_, reg::syscfg::kSyscfg),
      exti(around_, pins, syscfg, {reg::exti::kExti, kExtiLines, 0}),
      dma1(around_, 1, reg::dma::kDma1, memory),
      dma2(around_, 2, reg::dma::kDma2, memory),
      usart1(
          around_, "USART1", reg::usart::kUsart1, pins, kUsart1, [this] { return rcc.apb2_hz(); },
          [this](DmaRequest request) { return dma2.serve(request); }),
      usart2(
          around_, "USART2", reg::usart::kUsart2, pins, kUsart2, [this] { return rcc.apb1_hz(); },
          [this](DmaRequest request) { return dma1.serve(request); }),
      spi1(
          around_, "SPI1", reg::spi::kSpi1, pins, kSpi1, [this] { return rcc.apb2_hz(); },
          [this](DmaRequest request) { return dma2.serve(request); }),
      spi2(
          around_, "SPI2", reg::spi::kSpi2, pins, kSpi2, [this] { return rcc.apb1_hz(); },
          [this](DmaRequest request) { return dma1.serve(request); }),
      tim2(around_, "TIM2", reg::tim::kTim2, pins, kTim2, [this] { return rcc.apb1_timer_hz(); }),
      tim3(around_, "TIM3", reg::tim::kTim3, pins, kTim3, [this] { return rcc.apb1_timer_hz(); }),
      can1(around_, pins, [this] { return rcc.apb1_hz(); }),
      iwdg(around_, reg::iwdg::kIwdg, [this] { return rcc.lsi_hz(); }) {
  add_blocks();
  connect();
  start();
}

void Stm32f412::add_blocks() {
  const auto ahb1 = [this](Peripheral& block, hal::Field enable, hal::Field reset) {
    rcc.add_block(block, reg::rcc::ahb1enr::kOffset, enable.mask(), reg::rcc::ahb1rstr::kOffset, reset.mask());
  };
  const auto apb1 = [this](Peripheral& block, hal::Field enable, hal::Field reset) {
    rcc.add_block(block, reg::rcc::apb1enr::kOffset, enable.mask(), reg::rcc::apb1rstr::kOffset, reset.mask());
  };
  const auto apb2 = [this](Peripheral& block, hal::Field enable, hal::Field reset) {
    rcc.add_block(block, reg::rcc::apb2enr::kOffset, enable.mask(), reg::rcc::apb2rstr::kOffset, reset.mask());
  };
  ahb1(pins.port('A'), reg::rcc::ahb1enr::kGpioaen, reg::rcc::ahb1rstr::kGpioarst);
  ahb1(pins.port('B'), reg::rcc::ahb1enr::kGpioben, reg::rcc::ahb1rstr::kGpiobrst);
  ahb1(pins.port('C'), reg::rcc::ahb1enr::kGpiocen, reg::rcc::ahb1rstr::kGpiocrst);
  ahb1(dma1, reg::rcc::ahb1enr::kDma1en, reg::rcc::ahb1rstr::kDma1rst);
  ahb1(dma2, reg::rcc::ahb1enr::kDma2en, reg::rcc::ahb1rstr::kDma2rst);
  apb1(tim2, reg::rcc::apb1enr::kTim2en, reg::rcc::apb1rstr::kTim2rst);
  apb1(tim3, reg::rcc::apb1enr::kTim3en, reg::rcc::apb1rstr::kTim3rst);
  apb1(spi2, reg::rcc::apb1enr::kSpi2en, reg::rcc::apb1rstr::kSpi2rst);
  apb1(usart2, reg::rcc::apb1enr::kUsart2en, reg::rcc::apb1rstr::kUart2rst);
  apb1(can1, reg::rcc::apb1enr::kCan1en, reg::rcc::apb1rstr::kCan1rst);
  apb1(pwr, reg::rcc::apb1enr::kPwren, reg::rcc::apb1rstr::kPwrrst);
  apb2(usart1, reg::rcc::apb2enr::kUsart1en, reg::rcc::apb2rstr::kUsart1rst);
  apb2(spi1, reg::rcc::apb2enr::kSpi1en, reg::rcc::apb2rstr::kSpi1rst);
  apb2(syscfg, reg::rcc::apb2enr::kSyscfgen, reg::rcc::apb2rstr::kSyscfgrst);
  const std::initializer_list<Peripheral*> all = {
      &rcc,  &pwr,    &flash,  &pins.port('A'), &pins.port('B'), &pins.port('C'), &syscfg, &exti, &dma1,
      &dma2, &usart1, &usart2, &spi1,           &spi2,           &tim2,           &tim3,   &can1, &iwdg};
  for (Peripheral* block : all) place(*block);
}

void Stm32f412::connect() {
  for (Dma* dma : {&dma1, &dma2}) {
    dma->bus_read = [this](std::uint32_t address, int size) {
      std::uint32_t value = 0;
      (void)read(address, size, value);
      return value;
    };
    dma->bus_write = [this](std::uint32_t address, std::uint32_t value, int size) {
      (void)write(address, size, value);
    };
    dma->clocked = [this, dma] { return rcc.clocked(*dma); };
  }
  dma2.on_enable = [this] { usart1.raise_requests(), spi1.raise_requests(); };
  dma1.on_enable = [this] { usart2.raise_requests(), spi2.raise_requests(); };
  flash.on_change = [this] { rcc.check_limits(); };
  iwdg.on_expired = [this] { pending_reset = ResetCause::kWatchdog; };
}

}  // namespace tetap::board
