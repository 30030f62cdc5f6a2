// SPDX-License-Identifier: Apache-2.0
// The STM32F405 has the blocks, registers and fields that F4Chip uses where the STM32F412 has them: both SVDs,
// compared at compile time. The SVD of the STM32F405 lacks PWR_CR.VOS; RM0090 has one bit at 14.
#pragma once

#include "hal/chip/stm32/registers_stm32f405.hpp"
#include "hal/chip/stm32/registers_stm32f412.hpp"

#include <array>

namespace tetap::hal {

// clang-format off
#define TETAP_PLACES(chip)                                                                                             \
  std::to_array<std::uint32_t>({                                                                                                         \
      chip::rcc::kRcc, chip::rcc::cr::kOffset, chip::rcc::cr::kHsion.mask(), chip::rcc::cr::kHsirdy.mask(),            \
      chip::rcc::cr::kHseon.mask(), chip::rcc::cr::kHserdy.mask(), chip::rcc::cr::kHsebyp.mask(),                      \
      chip::rcc::cr::kCsson.mask(), chip::rcc::cr::kPllon.mask(), chip::rcc::cr::kPllrdy.mask(),                       \
      chip::rcc::pllcfgr::kOffset, chip::rcc::pllcfgr::kPllsrc.mask(), chip::rcc::cfgr::kOffset,                       \
      chip::rcc::cfgr::kHpre.mask(), chip::rcc::cfgr::kPpre1.mask(), chip::rcc::cfgr::kPpre2.mask(),                   \
      chip::rcc::ahb1rstr::kOffset, chip::rcc::ahb1rstr::kDma2rst.mask(), chip::rcc::apb1rstr::kOffset,                \
      chip::rcc::apb1rstr::kTim2rst.mask(), chip::rcc::apb1rstr::kTim3rst.mask(),                                      \
      chip::rcc::apb1rstr::kUart2rst.mask(), chip::rcc::apb1rstr::kCan1rst.mask(), chip::rcc::apb2rstr::kOffset,       \
      chip::rcc::apb2rstr::kUsart1rst.mask(), chip::rcc::apb2rstr::kSpi1rst.mask(), chip::rcc::ahb1enr::kOffset,       \
      chip::rcc::ahb1enr::kGpioaen.mask(), chip::rcc::ahb1enr::kGpioben.mask(),                                        \
      chip::rcc::ahb1enr::kGpiocen.mask(), chip::rcc::ahb1enr::kDma2en.mask(), chip::rcc::apb1enr::kOffset,            \
      chip::rcc::apb1enr::kTim2en.mask(), chip::rcc::apb1enr::kTim3en.mask(),                                          \
      chip::rcc::apb1enr::kUsart2en.mask(), chip::rcc::apb1enr::kCan1en.mask(),                                        \
      chip::rcc::apb1enr::kPwren.mask(), chip::rcc::apb2enr::kOffset, chip::rcc::apb2enr::kUsart1en.mask(),            \
      chip::rcc::apb2enr::kSpi1en.mask(), chip::rcc::csr::kOffset, chip::rcc::csr::kRmvf.mask(),                       \
      chip::rcc::csr::kBorrstf.mask(), chip::rcc::csr::kPadrstf.mask(), chip::rcc::csr::kPorrstf.mask(),               \
      chip::rcc::csr::kSftrstf.mask(), chip::rcc::csr::kWdgrstf.mask(), chip::rcc::csr::kWwdgrstf.mask(),              \
      chip::rcc::csr::kLpwrrstf.mask(), chip::pwr::kPwr, chip::pwr::cr::kOffset, chip::pwr::cr::kDbp.mask(),           \
      chip::pwr::csr::kOffset, chip::pwr::csr::kVosrdy.mask(), chip::flash::kFlash, chip::flash::acr::kOffset,         \
      chip::flash::acr::kLatency.mask(), chip::flash::acr::kPrften.mask(), chip::flash::acr::kIcen.mask(),             \
      chip::flash::acr::kDcen.mask(), chip::gpio::kGpioa, chip::gpio::kGpiob, chip::gpio::kGpioc,                      \
      chip::gpio::moder::kOffset, chip::gpio::moder::kModer0.mask(), chip::gpio::otyper::kOffset,                      \
      chip::gpio::otyper::kOt0.mask(), chip::gpio::ospeedr::kOffset, chip::gpio::ospeedr::kOspeedr0.mask(),            \
      chip::gpio::pupdr::kOffset, chip::gpio::pupdr::kPupdr0.mask(), chip::gpio::bsrr::kOffset,                        \
      chip::gpio::bsrr::kBs0.mask(), chip::gpio::bsrr::kBr0.mask(), chip::gpio::afrl::kOffset,                         \
      chip::gpio::afrl::kAfrl0.mask(), chip::gpio::afrh::kOffset, chip::gpio::afrh::kAfrh8.mask(),                     \
      chip::spi::kSpi1, chip::spi::cr1::kOffset, chip::spi::cr1::kCpha.mask(), chip::spi::cr1::kCpol.mask(),           \
      chip::spi::cr1::kMstr.mask(), chip::spi::cr1::kBr.mask(), chip::spi::cr1::kSpe.mask(),                           \
      chip::spi::cr1::kSsi.mask(), chip::spi::cr1::kSsm.mask(), chip::spi::cr2::kOffset,                               \
      chip::spi::cr2::kSsoe.mask(), chip::spi::sr::kOffset, chip::spi::sr::kRxne.mask(),                               \
      chip::spi::sr::kTxe.mask(), chip::spi::sr::kModf.mask(), chip::spi::sr::kOvr.mask(),                             \
      chip::spi::sr::kBsy.mask(), chip::spi::dr::kOffset, chip::spi::dr::kDr.mask(), chip::tim::kTim2,                 \
      chip::tim::kTim3, chip::tim::cr1::kOffset, chip::tim::cr1::kCen.mask(), chip::tim::smcr::kOffset,                \
      chip::tim::smcr::kSms.mask(), chip::tim::cnt::kOffset, chip::tim::psc::kOffset,                                  \
      chip::tim::psc::kPsc.mask(), chip::tim::arr::kOffset, chip::usart::kUsart1, chip::usart::kUsart2,                \
      chip::usart::sr::kOffset, chip::usart::sr::kFe.mask(), chip::usart::sr::kNf.mask(),                              \
      chip::usart::sr::kOre.mask(), chip::usart::sr::kIdle.mask(), chip::usart::sr::kRxne.mask(),                      \
      chip::usart::sr::kTc.mask(), chip::usart::sr::kTxe.mask(), chip::usart::dr::kOffset,                             \
      chip::usart::dr::kDr.mask(), chip::usart::brr::kOffset, chip::usart::brr::kDivFraction.mask(),                   \
      chip::usart::brr::kDivMantissa.mask(), chip::usart::cr1::kOffset, chip::usart::cr1::kRe.mask(),                  \
      chip::usart::cr1::kTe.mask(), chip::usart::cr1::kUe.mask(), chip::usart::cr2::kOffset,                           \
      chip::usart::cr2::kStop.mask(), chip::usart::cr3::kOffset, chip::usart::cr3::kEie.mask(),                        \
      chip::usart::cr3::kDmar.mask(), chip::usart::cr3::kDmat.mask(), chip::dma::kDma2, chip::can::kCan1,              \
      chip::can::mcr::kOffset, chip::can::mcr::kInrq.mask(), chip::can::mcr::kSleep.mask(),                            \
      chip::can::mcr::kTxfp.mask(), chip::can::mcr::kAbom.mask(), chip::can::msr::kOffset,                             \
      chip::can::msr::kInak.mask(), chip::can::btr::kOffset, chip::can::btr::kBrp.mask(),                              \
      chip::can::btr::kTs1.mask(), chip::can::btr::kTs2.mask(), chip::can::btr::kSjw.mask(), chip::iwdg::kIwdg,        \
      chip::iwdg::kr::kOffset, chip::iwdg::kr::kKey.mask(), chip::iwdg::pr::kOffset, chip::iwdg::pr::kPr.mask(),       \
      chip::iwdg::rlr::kOffset, chip::iwdg::rlr::kRl.mask(), chip::iwdg::sr::kOffset,                                  \
      chip::iwdg::sr::kPvu.mask(), chip::iwdg::sr::kRvu.mask(), chip::interrupt::kUsart1 + 0U,                         \
      chip::interrupt::kCan1Tx + 0U, chip::interrupt::kCan1Rx0 + 0U, chip::interrupt::kDma2Stream5 + 0U                \
  })
static_assert(TETAP_PLACES(stm32f405) == TETAP_PLACES(stm32f412));
#undef TETAP_PLACES
// clang-format on

// One SVD names the factors and the switch as fields, the other their bits.
static_assert(stm32f405::rcc::pllcfgr::kPllm0.lsb == stm32f412::rcc::pllcfgr::kPllm.lsb);
static_assert(stm32f405::rcc::pllcfgr::kPlln0.lsb == stm32f412::rcc::pllcfgr::kPlln.lsb);
static_assert(stm32f405::rcc::pllcfgr::kPllp0.lsb == stm32f412::rcc::pllcfgr::kPllp.lsb);
static_assert(stm32f405::rcc::pllcfgr::kPllq0.lsb == stm32f412::rcc::pllcfgr::kPllq.lsb);
static_assert(stm32f405::rcc::cfgr::kSw0.lsb == stm32f412::rcc::cfgr::kSw.lsb);
static_assert(stm32f405::rcc::cfgr::kSws0.lsb == stm32f412::rcc::cfgr::kSws.lsb);

}  // namespace tetap::hal
