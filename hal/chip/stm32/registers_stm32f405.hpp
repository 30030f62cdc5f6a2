// SPDX-License-Identifier: Apache-2.0
// clang-format off
// Generated from STM32F405.svd by tools/run/generate_registers with registers_stm32f405.toml: not to be edited.
// STM32F405 version 1.7, sha256 95d3a7d162d79e9c920ae4f3d886272ae284469543c0614ae249ed1d0c9cde73.
// Names, offsets, bit positions and descriptions: Copyright (c) 2024 STMicroelectronics, Apache-2.0.
#pragma once

#include "hal/chip/support/register_field.hpp"

#include <cstdint>

namespace tetap::hal::stm32f405 {

/// Numbers of the interrupts in the NVIC.
namespace interrupt {
inline constexpr int kUsart1 = 37;
inline constexpr int kCan1Tx = 19;
inline constexpr int kCan1Rx0 = 20;
inline constexpr int kDma2Stream5 = 68;
}  // namespace interrupt

namespace rcc {
inline constexpr std::uint32_t kRcc = 0x40023800;  ///< base address
/// RCC.CR: clock control register
namespace cr {
inline constexpr std::uint32_t kOffset = 0x000;
inline constexpr std::uint32_t kResetValue = 0x00000083;
inline constexpr Field kHsion{0, 1};
inline constexpr Field kHsirdy{1, 1};
inline constexpr Field kHseon{16, 1};
inline constexpr Field kHserdy{17, 1};
inline constexpr Field kHsebyp{18, 1};
inline constexpr Field kCsson{19, 1};
inline constexpr Field kPllon{24, 1};
inline constexpr Field kPllrdy{25, 1};
}
/// RCC.PLLCFGR: PLL configuration register
namespace pllcfgr {
inline constexpr std::uint32_t kOffset = 0x004;
inline constexpr std::uint32_t kResetValue = 0x24003010;
inline constexpr Field kPllm0{0, 1};
inline constexpr Field kPlln0{6, 1};
inline constexpr Field kPllp0{16, 1};
inline constexpr Field kPllsrc{22, 1};
inline constexpr Field kPllq0{24, 1};
}
/// RCC.CFGR: clock configuration register
namespace cfgr {
inline constexpr std::uint32_t kOffset = 0x008;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kSw0{0, 1};
inline constexpr Field kSws0{2, 1};
inline constexpr Field kHpre{4, 4};
inline constexpr Field kPpre1{10, 3};
inline constexpr Field kPpre2{13, 3};
}
/// RCC.AHB1RSTR: AHB1 peripheral reset register
namespace ahb1rstr {
inline constexpr std::uint32_t kOffset = 0x010;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kDma2rst{22, 1};
}
/// RCC.APB1RSTR: APB1 peripheral reset register
namespace apb1rstr {
inline constexpr std::uint32_t kOffset = 0x020;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kTim2rst{0, 1};
inline constexpr Field kTim3rst{1, 1};
inline constexpr Field kUart2rst{17, 1};
inline constexpr Field kCan1rst{25, 1};
}
/// RCC.APB2RSTR: APB2 peripheral reset register
namespace apb2rstr {
inline constexpr std::uint32_t kOffset = 0x024;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kUsart1rst{4, 1};
inline constexpr Field kSpi1rst{12, 1};
}
/// RCC.AHB1ENR: AHB1 peripheral clock register
namespace ahb1enr {
inline constexpr std::uint32_t kOffset = 0x030;
inline constexpr std::uint32_t kResetValue = 0x00100000;
inline constexpr Field kGpioaen{0, 1};
inline constexpr Field kGpioben{1, 1};
inline constexpr Field kGpiocen{2, 1};
inline constexpr Field kDma2en{22, 1};
}
/// RCC.APB1ENR: APB1 peripheral clock enable register
namespace apb1enr {
inline constexpr std::uint32_t kOffset = 0x040;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kTim2en{0, 1};
inline constexpr Field kTim3en{1, 1};
inline constexpr Field kUsart2en{17, 1};
inline constexpr Field kCan1en{25, 1};
inline constexpr Field kPwren{28, 1};
}
/// RCC.APB2ENR: APB2 peripheral clock enable register
namespace apb2enr {
inline constexpr std::uint32_t kOffset = 0x044;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kUsart1en{4, 1};
inline constexpr Field kSpi1en{12, 1};
}
/// RCC.CSR: clock control & status register
namespace csr {
inline constexpr std::uint32_t kOffset = 0x074;
inline constexpr std::uint32_t kResetValue = 0x0E000000;
inline constexpr Field kRmvf{24, 1};
inline constexpr Field kBorrstf{25, 1};
inline constexpr Field kPadrstf{26, 1};
inline constexpr Field kPorrstf{27, 1};
inline constexpr Field kSftrstf{28, 1};
inline constexpr Field kWdgrstf{29, 1};
inline constexpr Field kWwdgrstf{30, 1};
inline constexpr Field kLpwrrstf{31, 1};
}
}  // namespace rcc

namespace pwr {
inline constexpr std::uint32_t kPwr = 0x40007000;  ///< base address
/// PWR.CR: power control register
namespace cr {
inline constexpr std::uint32_t kOffset = 0x000;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kDbp{8, 1};
}
/// PWR.CSR: power control/status register
namespace csr {
inline constexpr std::uint32_t kOffset = 0x004;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kVosrdy{14, 1};
}
}  // namespace pwr

namespace flash {
inline constexpr std::uint32_t kFlash = 0x40023C00;  ///< base address
/// FLASH.ACR: Flash access control register
namespace acr {
inline constexpr std::uint32_t kOffset = 0x000;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kLatency{0, 3};
inline constexpr Field kPrften{8, 1};
inline constexpr Field kIcen{9, 1};
inline constexpr Field kDcen{10, 1};
}
}  // namespace flash

namespace gpio {
inline constexpr std::uint32_t kGpioa = 0x40020000;  ///< base address
inline constexpr std::uint32_t kGpiob = 0x40020400;  ///< base address
inline constexpr std::uint32_t kGpioc = 0x40020800;  ///< base address
/// GPIOA.MODER: GPIO port mode register
namespace moder {
inline constexpr std::uint32_t kOffset = 0x000;
inline constexpr std::uint32_t kResetValueGpioa = 0xA8000000;
inline constexpr std::uint32_t kResetValueGpiob = 0x00000280;
inline constexpr std::uint32_t kResetValueGpioc = 0x00000000;
inline constexpr Field kModer0{0, 2};
}
/// GPIOA.OTYPER: GPIO port output type register
namespace otyper {
inline constexpr std::uint32_t kOffset = 0x004;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kOt0{0, 1};
}
/// GPIOA.OSPEEDR: GPIO port output speed register
namespace ospeedr {
inline constexpr std::uint32_t kOffset = 0x008;
inline constexpr std::uint32_t kResetValueGpioa = 0x00000000;
inline constexpr std::uint32_t kResetValueGpiob = 0x000000C0;
inline constexpr std::uint32_t kResetValueGpioc = 0x00000000;
inline constexpr Field kOspeedr0{0, 2};
}
/// GPIOA.PUPDR: GPIO port pull-up/pull-down register
namespace pupdr {
inline constexpr std::uint32_t kOffset = 0x00C;
inline constexpr std::uint32_t kResetValueGpioa = 0x64000000;
inline constexpr std::uint32_t kResetValueGpiob = 0x00000100;
inline constexpr std::uint32_t kResetValueGpioc = 0x00000000;
inline constexpr Field kPupdr0{0, 2};
}
/// GPIOA.BSRR: GPIO port bit set/reset register
namespace bsrr {
inline constexpr std::uint32_t kOffset = 0x018;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kBs0{0, 1};
inline constexpr Field kBr0{16, 1};
}
/// GPIOA.AFRL: GPIO alternate function low register
namespace afrl {
inline constexpr std::uint32_t kOffset = 0x020;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kAfrl0{0, 4};
}
/// GPIOA.AFRH: GPIO alternate function high register
namespace afrh {
inline constexpr std::uint32_t kOffset = 0x024;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kAfrh8{0, 4};
}
}  // namespace gpio

namespace spi {
inline constexpr std::uint32_t kSpi1 = 0x40013000;  ///< base address
/// SPI1.CR1: control register 1
namespace cr1 {
inline constexpr std::uint32_t kOffset = 0x000;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kCpha{0, 1};
inline constexpr Field kCpol{1, 1};
inline constexpr Field kMstr{2, 1};
inline constexpr Field kBr{3, 3};
inline constexpr Field kSpe{6, 1};
inline constexpr Field kSsi{8, 1};
inline constexpr Field kSsm{9, 1};
}
/// SPI1.CR2: control register 2
namespace cr2 {
inline constexpr std::uint32_t kOffset = 0x004;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kSsoe{2, 1};
}
/// SPI1.SR: status register
namespace sr {
inline constexpr std::uint32_t kOffset = 0x008;
inline constexpr std::uint32_t kResetValue = 0x00000002;
inline constexpr Field kRxne{0, 1};
inline constexpr Field kTxe{1, 1};
inline constexpr Field kModf{5, 1};
inline constexpr Field kOvr{6, 1};
inline constexpr Field kBsy{7, 1};
}
/// SPI1.DR: data register
namespace dr {
inline constexpr std::uint32_t kOffset = 0x00C;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kDr{0, 16};
}
}  // namespace spi

namespace tim {
inline constexpr std::uint32_t kTim2 = 0x40000000;  ///< base address
inline constexpr std::uint32_t kTim3 = 0x40000400;  ///< base address
/// TIM2.CR1: control register 1
namespace cr1 {
inline constexpr std::uint32_t kOffset = 0x000;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kCen{0, 1};
}
/// TIM2.SMCR: slave mode control register
namespace smcr {
inline constexpr std::uint32_t kOffset = 0x008;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kSms{0, 3};
}
/// TIM2.CNT: counter
namespace cnt {
inline constexpr std::uint32_t kOffset = 0x024;
inline constexpr std::uint32_t kResetValue = 0x00000000;
}
/// TIM2.PSC: prescaler
namespace psc {
inline constexpr std::uint32_t kOffset = 0x028;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kPsc{0, 16};
}
/// TIM2.ARR: auto-reload register
namespace arr {
inline constexpr std::uint32_t kOffset = 0x02C;
inline constexpr std::uint32_t kResetValue = 0x00000000;
}
}  // namespace tim

namespace usart {
inline constexpr std::uint32_t kUsart1 = 0x40011000;  ///< base address
inline constexpr std::uint32_t kUsart2 = 0x40004400;  ///< base address
/// USART1.SR: Status register
namespace sr {
inline constexpr std::uint32_t kOffset = 0x000;
inline constexpr std::uint32_t kResetValue = 0x00C00000;
inline constexpr Field kFe{1, 1};
inline constexpr Field kNf{2, 1};
inline constexpr Field kOre{3, 1};
inline constexpr Field kIdle{4, 1};
inline constexpr Field kRxne{5, 1};
inline constexpr Field kTc{6, 1};
inline constexpr Field kTxe{7, 1};
}
/// USART1.DR: Data register
namespace dr {
inline constexpr std::uint32_t kOffset = 0x004;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kDr{0, 9};
}
/// USART1.BRR: Baud rate register
namespace brr {
inline constexpr std::uint32_t kOffset = 0x008;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kDivFraction{0, 4};
inline constexpr Field kDivMantissa{4, 12};
}
/// USART1.CR1: Control register 1
namespace cr1 {
inline constexpr std::uint32_t kOffset = 0x00C;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kRe{2, 1};
inline constexpr Field kTe{3, 1};
inline constexpr Field kUe{13, 1};
}
/// USART1.CR2: Control register 2
namespace cr2 {
inline constexpr std::uint32_t kOffset = 0x010;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kStop{12, 2};
}
/// USART1.CR3: Control register 3
namespace cr3 {
inline constexpr std::uint32_t kOffset = 0x014;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kEie{0, 1};
inline constexpr Field kDmar{6, 1};
inline constexpr Field kDmat{7, 1};
}
}  // namespace usart

namespace dma {
inline constexpr std::uint32_t kDma2 = 0x40026400;  ///< base address
}  // namespace dma

namespace can {
inline constexpr std::uint32_t kCan1 = 0x40006400;  ///< base address
/// CAN1.MCR: master control register
namespace mcr {
inline constexpr std::uint32_t kOffset = 0x000;
inline constexpr std::uint32_t kResetValue = 0x00010002;
inline constexpr Field kInrq{0, 1};
inline constexpr Field kSleep{1, 1};
inline constexpr Field kTxfp{2, 1};
inline constexpr Field kAbom{6, 1};
}
/// CAN1.MSR: master status register
namespace msr {
inline constexpr std::uint32_t kOffset = 0x004;
inline constexpr std::uint32_t kResetValue = 0x00000C02;
inline constexpr Field kInak{0, 1};
}
/// CAN1.BTR: bit timing register
namespace btr {
inline constexpr std::uint32_t kOffset = 0x01C;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kBrp{0, 10};
inline constexpr Field kTs1{16, 4};
inline constexpr Field kTs2{20, 3};
inline constexpr Field kSjw{24, 2};
}
}  // namespace can

namespace iwdg {
inline constexpr std::uint32_t kIwdg = 0x40003000;  ///< base address
/// IWDG.KR: Key register
namespace kr {
inline constexpr std::uint32_t kOffset = 0x000;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kKey{0, 16};
}
/// IWDG.PR: Prescaler register
namespace pr {
inline constexpr std::uint32_t kOffset = 0x004;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kPr{0, 3};
}
/// IWDG.RLR: Reload register
namespace rlr {
inline constexpr std::uint32_t kOffset = 0x008;
inline constexpr std::uint32_t kResetValue = 0x00000FFF;
inline constexpr Field kRl{0, 12};
}
/// IWDG.SR: Status register
namespace sr {
inline constexpr std::uint32_t kOffset = 0x00C;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kPvu{0, 1};
inline constexpr Field kRvu{1, 1};
}
}  // namespace iwdg

}  // namespace tetap::hal::stm32f405
