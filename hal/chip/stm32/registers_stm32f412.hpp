// SPDX-License-Identifier: Apache-2.0
// clang-format off
// Generated from STM32F412.svd by tools/run/generate_registers with registers_stm32f412.toml: not to be edited.
// STM32F412 version 1.7, sha256 82087e3a380af71445a4c6fd51f75676647978b916dc2f82c11c476e8e50e37c.
// Names, offsets, bit positions and descriptions: Copyright (c) 2024 STMicroelectronics, Apache-2.0.
#pragma once

#include "hal/chip/support/register_field.hpp"

#include <cstdint>

namespace tetap::hal::stm32f412 {

/// Numbers of the interrupts in the NVIC.
namespace interrupt {
inline constexpr int kExti0 = 6;
inline constexpr int kExti1 = 7;
inline constexpr int kExti2 = 8;
inline constexpr int kExti3 = 9;
inline constexpr int kExti4 = 10;
inline constexpr int kExti95 = 23;
inline constexpr int kExti1510 = 40;
inline constexpr int kTim2 = 28;
inline constexpr int kTim3 = 29;
inline constexpr int kSpi1 = 35;
inline constexpr int kSpi2 = 36;
inline constexpr int kUsart1 = 37;
inline constexpr int kUsart2 = 38;
inline constexpr int kCan1Tx = 19;
inline constexpr int kCan1Rx0 = 20;
inline constexpr int kCan1Rx1 = 21;
inline constexpr int kCan1Sce = 22;
inline constexpr int kDma1Stream0 = 11;
inline constexpr int kDma1Stream2 = 13;
inline constexpr int kDma1Stream3 = 14;
inline constexpr int kDma1Stream4 = 15;
inline constexpr int kDma1Stream5 = 16;
inline constexpr int kDma1Stream6 = 17;
inline constexpr int kDma1Stream7 = 47;
inline constexpr int kDma2Stream0 = 56;
inline constexpr int kDma2Stream1 = 57;
inline constexpr int kDma2Stream2 = 58;
inline constexpr int kDma2Stream3 = 59;
inline constexpr int kDma2Stream4 = 60;
inline constexpr int kDma2Stream5 = 68;
inline constexpr int kDma2Stream6 = 69;
inline constexpr int kDma2Stream7 = 70;
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
inline constexpr Field kPllm{0, 6};
inline constexpr Field kPlln{6, 9};
inline constexpr Field kPllp{16, 2};
inline constexpr Field kPllsrc{22, 1};
inline constexpr Field kPllq{24, 4};
inline constexpr Field kPllr{28, 3};
}
/// RCC.CFGR: clock configuration register
namespace cfgr {
inline constexpr std::uint32_t kOffset = 0x008;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kSw{0, 2};
inline constexpr Field kSws{2, 2};
inline constexpr Field kHpre{4, 4};
inline constexpr Field kPpre1{10, 3};
inline constexpr Field kPpre2{13, 3};
}
/// RCC.CIR: clock interrupt register
namespace cir {
inline constexpr std::uint32_t kOffset = 0x00C;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kCssf{7, 1};
inline constexpr Field kCssc{23, 1};
}
/// RCC.AHB1RSTR: AHB1 peripheral reset register
namespace ahb1rstr {
inline constexpr std::uint32_t kOffset = 0x010;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kGpioarst{0, 1};
inline constexpr Field kGpiobrst{1, 1};
inline constexpr Field kGpiocrst{2, 1};
inline constexpr Field kDma1rst{21, 1};
inline constexpr Field kDma2rst{22, 1};
}
/// RCC.APB1RSTR: APB1 peripheral reset register
namespace apb1rstr {
inline constexpr std::uint32_t kOffset = 0x020;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kTim2rst{0, 1};
inline constexpr Field kTim3rst{1, 1};
inline constexpr Field kSpi2rst{14, 1};
inline constexpr Field kUart2rst{17, 1};
inline constexpr Field kCan1rst{25, 1};
inline constexpr Field kPwrrst{28, 1};
}
/// RCC.APB2RSTR: APB2 peripheral reset register
namespace apb2rstr {
inline constexpr std::uint32_t kOffset = 0x024;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kUsart1rst{4, 1};
inline constexpr Field kSpi1rst{12, 1};
inline constexpr Field kSyscfgrst{14, 1};
}
/// RCC.AHB1ENR: AHB1 peripheral clock register
namespace ahb1enr {
inline constexpr std::uint32_t kOffset = 0x030;
inline constexpr std::uint32_t kResetValue = 0x00100000;
inline constexpr Field kGpioaen{0, 1};
inline constexpr Field kGpioben{1, 1};
inline constexpr Field kGpiocen{2, 1};
inline constexpr Field kDma1en{21, 1};
inline constexpr Field kDma2en{22, 1};
}
/// RCC.APB1ENR: APB1 peripheral clock enable register
namespace apb1enr {
inline constexpr std::uint32_t kOffset = 0x040;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kTim2en{0, 1};
inline constexpr Field kTim3en{1, 1};
inline constexpr Field kSpi2en{14, 1};
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
inline constexpr Field kSyscfgen{14, 1};
}
/// RCC.CSR: clock control & status register
namespace csr {
inline constexpr std::uint32_t kOffset = 0x074;
inline constexpr std::uint32_t kResetValue = 0x0E000000;
inline constexpr Field kLsion{0, 1};
inline constexpr Field kLsirdy{1, 1};
inline constexpr Field kRmvf{24, 1};
inline constexpr Field kBorrstf{25, 1};
inline constexpr Field kPadrstf{26, 1};
inline constexpr Field kPorrstf{27, 1};
inline constexpr Field kSftrstf{28, 1};
inline constexpr Field kWdgrstf{29, 1};
inline constexpr Field kWwdgrstf{30, 1};
inline constexpr Field kLpwrrstf{31, 1};
}
/// RCC.DCKCFGR: Dedicated Clocks Configuration Register
namespace dckcfgr {
inline constexpr std::uint32_t kOffset = 0x08C;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kTimpre{24, 1};
}
}  // namespace rcc

namespace pwr {
inline constexpr std::uint32_t kPwr = 0x40007000;  ///< base address
/// PWR.CR: power control register
namespace cr {
inline constexpr std::uint32_t kOffset = 0x000;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kDbp{8, 1};
inline constexpr Field kVos{14, 2};
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
inline constexpr Field kIcrst{11, 1};
inline constexpr Field kDcrst{12, 1};
}
/// FLASH.KEYR: Flash key register
namespace keyr {
inline constexpr std::uint32_t kOffset = 0x004;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kKey{0, 32};
}
/// FLASH.SR: Status register
namespace sr {
inline constexpr std::uint32_t kOffset = 0x00C;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kEop{0, 1};
inline constexpr Field kOperr{1, 1};
inline constexpr Field kWrperr{4, 1};
inline constexpr Field kPgaerr{5, 1};
inline constexpr Field kPgperr{6, 1};
inline constexpr Field kPgserr{7, 1};
inline constexpr Field kBsy{16, 1};
}
/// FLASH.CR: Control register
namespace cr {
inline constexpr std::uint32_t kOffset = 0x010;
inline constexpr std::uint32_t kResetValue = 0x80000000;
inline constexpr Field kPg{0, 1};
inline constexpr Field kSer{1, 1};
inline constexpr Field kMer{2, 1};
inline constexpr Field kSnb{3, 4};
inline constexpr Field kPsize{8, 2};
inline constexpr Field kStrt{16, 1};
inline constexpr Field kEopie{24, 1};
inline constexpr Field kErrie{25, 1};
inline constexpr Field kLock{31, 1};
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
/// GPIOA.IDR: GPIO port input data register
namespace idr {
inline constexpr std::uint32_t kOffset = 0x010;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kIdr0{0, 1};
}
/// GPIOA.ODR: GPIO port output data register
namespace odr {
inline constexpr std::uint32_t kOffset = 0x014;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kOdr0{0, 1};
}
/// GPIOA.BSRR: GPIO port bit set/reset register
namespace bsrr {
inline constexpr std::uint32_t kOffset = 0x018;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kBs0{0, 1};
inline constexpr Field kBr0{16, 1};
}
/// GPIOA.LCKR: GPIO port configuration lock register
namespace lckr {
inline constexpr std::uint32_t kOffset = 0x01C;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kLckk{16, 1};
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

namespace exti {
inline constexpr std::uint32_t kExti = 0x40013C00;  ///< base address
/// EXTI.IMR: Interrupt mask register (EXTI_IMR)
namespace imr {
inline constexpr std::uint32_t kOffset = 0x000;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kMr0{0, 1};
}
/// EXTI.EMR: Event mask register (EXTI_EMR)
namespace emr {
inline constexpr std::uint32_t kOffset = 0x004;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kMr0{0, 1};
}
/// EXTI.RTSR: Rising Trigger selection register (EXTI_RTSR)
namespace rtsr {
inline constexpr std::uint32_t kOffset = 0x008;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kTr0{0, 1};
}
/// EXTI.FTSR: Falling Trigger selection register (EXTI_FTSR)
namespace ftsr {
inline constexpr std::uint32_t kOffset = 0x00C;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kTr0{0, 1};
}
/// EXTI.SWIER: Software interrupt event register (EXTI_SWIER)
namespace swier {
inline constexpr std::uint32_t kOffset = 0x010;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kSwier0{0, 1};
}
/// EXTI.PR: Pending register (EXTI_PR)
namespace pr {
inline constexpr std::uint32_t kOffset = 0x014;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kPr0{0, 1};
}
}  // namespace exti

namespace syscfg {
inline constexpr std::uint32_t kSyscfg = 0x40013800;  ///< base address
/// SYSCFG.EXTICR#: external interrupt configuration register 1
namespace exticrx {
inline constexpr std::uint32_t kOffset = 0x008;
inline constexpr std::uint32_t kStride = 0x04, kCount = 4;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kExti0{0, 4};
}
}  // namespace syscfg

namespace spi {
inline constexpr std::uint32_t kSpi1 = 0x40013000;  ///< base address
inline constexpr std::uint32_t kSpi2 = 0x40003800;  ///< base address
/// SPI1.CR1: control register 1
namespace cr1 {
inline constexpr std::uint32_t kOffset = 0x000;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kCpha{0, 1};
inline constexpr Field kCpol{1, 1};
inline constexpr Field kMstr{2, 1};
inline constexpr Field kBr{3, 3};
inline constexpr Field kSpe{6, 1};
inline constexpr Field kLsbfirst{7, 1};
inline constexpr Field kSsi{8, 1};
inline constexpr Field kSsm{9, 1};
inline constexpr Field kRxonly{10, 1};
inline constexpr Field kDff{11, 1};
inline constexpr Field kCrcen{13, 1};
inline constexpr Field kBidimode{15, 1};
}
/// SPI1.CR2: control register 2
namespace cr2 {
inline constexpr std::uint32_t kOffset = 0x004;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kRxdmaen{0, 1};
inline constexpr Field kTxdmaen{1, 1};
inline constexpr Field kSsoe{2, 1};
inline constexpr Field kErrie{5, 1};
inline constexpr Field kRxneie{6, 1};
inline constexpr Field kTxeie{7, 1};
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
inline constexpr Field kUdis{1, 1};
inline constexpr Field kUrs{2, 1};
inline constexpr Field kOpm{3, 1};
inline constexpr Field kDir{4, 1};
inline constexpr Field kCms{5, 2};
inline constexpr Field kArpe{7, 1};
inline constexpr Field kCkd{8, 2};
}
/// TIM2.SMCR: slave mode control register
namespace smcr {
inline constexpr std::uint32_t kOffset = 0x008;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kSms{0, 3};
}
/// TIM2.DIER: DMA/Interrupt enable register
namespace dier {
inline constexpr std::uint32_t kOffset = 0x00C;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kUie{0, 1};
}
/// TIM2.SR: status register
namespace sr {
inline constexpr std::uint32_t kOffset = 0x010;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kUif{0, 1};
}
/// TIM2.EGR: event generation register
namespace egr {
inline constexpr std::uint32_t kOffset = 0x014;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kUg{0, 1};
}
/// TIM2.CCMR1_Input: capture/compare mode register 1 (input mode)
namespace ccmr1_input {
inline constexpr std::uint32_t kOffset = 0x018;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kCc1s{0, 2};
inline constexpr Field kIcpcs{2, 2};
inline constexpr Field kIc1f{4, 4};
inline constexpr Field kCc2s{8, 2};
inline constexpr Field kIc2pcs{10, 2};
inline constexpr Field kIc2f{12, 4};
}
/// TIM2.CCER: capture/compare enable register
namespace ccer {
inline constexpr std::uint32_t kOffset = 0x020;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kCc1e{0, 1};
inline constexpr Field kCc1p{1, 1};
inline constexpr Field kCc1np{3, 1};
inline constexpr Field kCc2e{4, 1};
inline constexpr Field kCc2p{5, 1};
inline constexpr Field kCc2np{7, 1};
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
inline constexpr Field kPe{0, 1};
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
inline constexpr Field kIdleie{4, 1};
inline constexpr Field kRxneie{5, 1};
inline constexpr Field kTcie{6, 1};
inline constexpr Field kTxeie{7, 1};
inline constexpr Field kPeie{8, 1};
inline constexpr Field kPs{9, 1};
inline constexpr Field kPce{10, 1};
inline constexpr Field kM{12, 1};
inline constexpr Field kUe{13, 1};
inline constexpr Field kOver8{15, 1};
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
inline constexpr Field kOnebit{11, 1};
}
}  // namespace usart

namespace can {
inline constexpr std::uint32_t kCan1 = 0x40006400;  ///< base address
/// CAN1.MCR: master control register
namespace mcr {
inline constexpr std::uint32_t kOffset = 0x000;
inline constexpr std::uint32_t kResetValue = 0x00010002;
inline constexpr Field kInrq{0, 1};
inline constexpr Field kSleep{1, 1};
inline constexpr Field kTxfp{2, 1};
inline constexpr Field kRflm{3, 1};
inline constexpr Field kNart{4, 1};
inline constexpr Field kAwum{5, 1};
inline constexpr Field kAbom{6, 1};
inline constexpr Field kTtcm{7, 1};
inline constexpr Field kReset{15, 1};
inline constexpr Field kDbf{16, 1};
}
/// CAN1.MSR: master status register
namespace msr {
inline constexpr std::uint32_t kOffset = 0x004;
inline constexpr std::uint32_t kResetValue = 0x00000C02;
inline constexpr Field kInak{0, 1};
inline constexpr Field kSlak{1, 1};
inline constexpr Field kErri{2, 1};
inline constexpr Field kWkui{3, 1};
inline constexpr Field kSlaki{4, 1};
inline constexpr Field kTxm{8, 1};
inline constexpr Field kRxm{9, 1};
inline constexpr Field kSamp{10, 1};
inline constexpr Field kRx{11, 1};
}
/// CAN1.TSR: transmit status register
namespace tsr {
inline constexpr std::uint32_t kOffset = 0x008;
inline constexpr std::uint32_t kResetValue = 0x1C000000;
inline constexpr Field kRqcp0{0, 1};
inline constexpr Field kTxok0{1, 1};
inline constexpr Field kAlst0{2, 1};
inline constexpr Field kTerr0{3, 1};
inline constexpr Field kAbrq0{7, 1};
inline constexpr Field kRqcp1{8, 1};
inline constexpr Field kTxok1{9, 1};
inline constexpr Field kAlst1{10, 1};
inline constexpr Field kTerr1{11, 1};
inline constexpr Field kAbrq1{15, 1};
inline constexpr Field kRqcp2{16, 1};
inline constexpr Field kTxok2{17, 1};
inline constexpr Field kAlst2{18, 1};
inline constexpr Field kTerr2{19, 1};
inline constexpr Field kAbrq2{23, 1};
inline constexpr Field kCode{24, 2};
inline constexpr Field kTme0{26, 1};
inline constexpr Field kTme1{27, 1};
inline constexpr Field kTme2{28, 1};
inline constexpr Field kLow0{29, 1};
inline constexpr Field kLow1{30, 1};
inline constexpr Field kLow2{31, 1};
}
/// CAN1.RF0R: receive FIFO 0 register
namespace rf0r {
inline constexpr std::uint32_t kOffset = 0x00C;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kFmp0{0, 2};
inline constexpr Field kFull0{3, 1};
inline constexpr Field kFovr0{4, 1};
inline constexpr Field kRfom0{5, 1};
}
/// CAN1.RF1R: receive FIFO 1 register
namespace rf1r {
inline constexpr std::uint32_t kOffset = 0x010;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kFmp1{0, 2};
inline constexpr Field kFull1{3, 1};
inline constexpr Field kFovr1{4, 1};
inline constexpr Field kRfom1{5, 1};
}
/// CAN1.IER: interrupt enable register
namespace ier {
inline constexpr std::uint32_t kOffset = 0x014;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kTmeie{0, 1};
inline constexpr Field kFmpie0{1, 1};
inline constexpr Field kFfie0{2, 1};
inline constexpr Field kFovie0{3, 1};
inline constexpr Field kFmpie1{4, 1};
inline constexpr Field kFfie1{5, 1};
inline constexpr Field kFovie1{6, 1};
inline constexpr Field kEwgie{8, 1};
inline constexpr Field kEpvie{9, 1};
inline constexpr Field kBofie{10, 1};
inline constexpr Field kLecie{11, 1};
inline constexpr Field kErrie{15, 1};
inline constexpr Field kWkuie{16, 1};
inline constexpr Field kSlkie{17, 1};
}
/// CAN1.ESR: interrupt enable register
namespace esr {
inline constexpr std::uint32_t kOffset = 0x018;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kEwgf{0, 1};
inline constexpr Field kEpvf{1, 1};
inline constexpr Field kBoff{2, 1};
inline constexpr Field kLec{4, 3};
inline constexpr Field kTec{16, 8};
inline constexpr Field kRec{24, 8};
}
/// CAN1.BTR: bit timing register
namespace btr {
inline constexpr std::uint32_t kOffset = 0x01C;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kBrp{0, 10};
inline constexpr Field kTs1{16, 4};
inline constexpr Field kTs2{20, 3};
inline constexpr Field kSjw{24, 2};
inline constexpr Field kLbkm{30, 1};
inline constexpr Field kSilm{31, 1};
}
/// CAN1.TI#R: TX mailbox identifier register
namespace tixr {
inline constexpr std::uint32_t kOffset = 0x180;
inline constexpr std::uint32_t kStride = 0x10, kCount = 3;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kStid{21, 11};
inline constexpr Field kExid{3, 18};
inline constexpr Field kIde{2, 1};
inline constexpr Field kRtr{1, 1};
inline constexpr Field kTxrq{0, 1};
}
/// CAN1.TDT#R: mailbox data length control and time stamp register
namespace tdtxr {
inline constexpr std::uint32_t kOffset = 0x184;
inline constexpr std::uint32_t kStride = 0x10, kCount = 3;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kDlc{0, 4};
}
/// CAN1.TDL#R: mailbox data low register
namespace tdlxr {
inline constexpr std::uint32_t kOffset = 0x188;
inline constexpr std::uint32_t kStride = 0x10, kCount = 3;
inline constexpr std::uint32_t kResetValue = 0x00000000;
}
/// CAN1.TDH#R: mailbox data high register
namespace tdhxr {
inline constexpr std::uint32_t kOffset = 0x18C;
inline constexpr std::uint32_t kStride = 0x10, kCount = 3;
inline constexpr std::uint32_t kResetValue = 0x00000000;
}
/// CAN1.RI#R: receive FIFO mailbox identifier register
namespace rixr {
inline constexpr std::uint32_t kOffset = 0x1B0;
inline constexpr std::uint32_t kStride = 0x10, kCount = 2;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kStid{21, 11};
inline constexpr Field kExid{3, 18};
inline constexpr Field kIde{2, 1};
inline constexpr Field kRtr{1, 1};
}
/// CAN1.RDT#R: mailbox data high register
namespace rdtxr {
inline constexpr std::uint32_t kOffset = 0x1B4;
inline constexpr std::uint32_t kStride = 0x10, kCount = 2;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kDlc{0, 4};
inline constexpr Field kFmi{8, 8};
inline constexpr Field kTime{16, 16};
}
/// CAN1.RDL#R: mailbox data high register
namespace rdlxr {
inline constexpr std::uint32_t kOffset = 0x1B8;
inline constexpr std::uint32_t kStride = 0x10, kCount = 2;
inline constexpr std::uint32_t kResetValue = 0x00000000;
}
/// CAN1.RDH#R: receive FIFO mailbox data high register
namespace rdhxr {
inline constexpr std::uint32_t kOffset = 0x1BC;
inline constexpr std::uint32_t kStride = 0x10, kCount = 2;
inline constexpr std::uint32_t kResetValue = 0x00000000;
}
/// CAN1.FMR: filter master register
namespace fmr {
inline constexpr std::uint32_t kOffset = 0x200;
inline constexpr std::uint32_t kResetValue = 0x2A1C0E01;
inline constexpr Field kFinit{0, 1};
}
/// CAN1.FM1R: filter mode register
namespace fm1r {
inline constexpr std::uint32_t kOffset = 0x204;
inline constexpr std::uint32_t kResetValue = 0x00000000;
}
/// CAN1.FS1R: filter scale register
namespace fs1r {
inline constexpr std::uint32_t kOffset = 0x20C;
inline constexpr std::uint32_t kResetValue = 0x00000000;
}
/// CAN1.FFA1R: filter FIFO assignment register
namespace ffa1r {
inline constexpr std::uint32_t kOffset = 0x214;
inline constexpr std::uint32_t kResetValue = 0x00000000;
}
/// CAN1.FA1R: filter activation register
namespace fa1r {
inline constexpr std::uint32_t kOffset = 0x21C;
inline constexpr std::uint32_t kResetValue = 0x00000000;
}
/// CAN1.F#R1: Filter bank 0 register 1
namespace fxr1 {
inline constexpr std::uint32_t kOffset = 0x240;
inline constexpr std::uint32_t kStride = 0x08, kCount = 28;
inline constexpr std::uint32_t kResetValue = 0x00000000;
}
/// CAN1.F#R2: Filter bank 0 register 2
namespace fxr2 {
inline constexpr std::uint32_t kOffset = 0x244;
inline constexpr std::uint32_t kStride = 0x08, kCount = 28;
inline constexpr std::uint32_t kResetValue = 0x00000000;
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

namespace dma {
inline constexpr std::uint32_t kDma1 = 0x40026000;  ///< base address
inline constexpr std::uint32_t kDma2 = 0x40026400;  ///< base address
/// DMA1.LISR: low interrupt status register
namespace lisr {
inline constexpr std::uint32_t kOffset = 0x000;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kFeif0{0, 1};
inline constexpr Field kDmeif0{2, 1};
inline constexpr Field kTeif0{3, 1};
inline constexpr Field kHtif0{4, 1};
inline constexpr Field kTcif0{5, 1};
inline constexpr Field kFeif1{6, 1};
inline constexpr Field kDmeif1{8, 1};
inline constexpr Field kTeif1{9, 1};
inline constexpr Field kHtif1{10, 1};
inline constexpr Field kTcif1{11, 1};
inline constexpr Field kFeif2{16, 1};
inline constexpr Field kDmeif2{18, 1};
inline constexpr Field kTeif2{19, 1};
inline constexpr Field kHtif2{20, 1};
inline constexpr Field kTcif2{21, 1};
inline constexpr Field kFeif3{22, 1};
inline constexpr Field kDmeif3{24, 1};
inline constexpr Field kTeif3{25, 1};
inline constexpr Field kHtif3{26, 1};
inline constexpr Field kTcif3{27, 1};
}
/// DMA1.HISR: high interrupt status register
namespace hisr {
inline constexpr std::uint32_t kOffset = 0x004;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kFeif4{0, 1};
inline constexpr Field kDmeif4{2, 1};
inline constexpr Field kTeif4{3, 1};
inline constexpr Field kHtif4{4, 1};
inline constexpr Field kTcif4{5, 1};
inline constexpr Field kFeif5{6, 1};
inline constexpr Field kDmeif5{8, 1};
inline constexpr Field kTeif5{9, 1};
inline constexpr Field kHtif5{10, 1};
inline constexpr Field kTcif5{11, 1};
inline constexpr Field kFeif6{16, 1};
inline constexpr Field kDmeif6{18, 1};
inline constexpr Field kTeif6{19, 1};
inline constexpr Field kHtif6{20, 1};
inline constexpr Field kTcif6{21, 1};
inline constexpr Field kFeif7{22, 1};
inline constexpr Field kDmeif7{24, 1};
inline constexpr Field kTeif7{25, 1};
inline constexpr Field kHtif7{26, 1};
inline constexpr Field kTcif7{27, 1};
}
/// DMA1.LIFCR: low interrupt flag clear register
namespace lifcr {
inline constexpr std::uint32_t kOffset = 0x008;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kCfeif0{0, 1};
inline constexpr Field kCdmeif0{2, 1};
inline constexpr Field kCteif0{3, 1};
inline constexpr Field kChtif0{4, 1};
inline constexpr Field kCtcif0{5, 1};
inline constexpr Field kCfeif1{6, 1};
inline constexpr Field kCdmeif1{8, 1};
inline constexpr Field kCteif1{9, 1};
inline constexpr Field kChtif1{10, 1};
inline constexpr Field kCtcif1{11, 1};
inline constexpr Field kCfeif2{16, 1};
inline constexpr Field kCdmeif2{18, 1};
inline constexpr Field kCteif2{19, 1};
inline constexpr Field kChtif2{20, 1};
inline constexpr Field kCtcif2{21, 1};
inline constexpr Field kCfeif3{22, 1};
inline constexpr Field kCdmeif3{24, 1};
inline constexpr Field kCteif3{25, 1};
inline constexpr Field kChtif3{26, 1};
inline constexpr Field kCtcif3{27, 1};
}
/// DMA1.HIFCR: high interrupt flag clear register
namespace hifcr {
inline constexpr std::uint32_t kOffset = 0x00C;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kCfeif4{0, 1};
inline constexpr Field kCdmeif4{2, 1};
inline constexpr Field kCteif4{3, 1};
inline constexpr Field kChtif4{4, 1};
inline constexpr Field kCtcif4{5, 1};
inline constexpr Field kCfeif5{6, 1};
inline constexpr Field kCdmeif5{8, 1};
inline constexpr Field kCteif5{9, 1};
inline constexpr Field kChtif5{10, 1};
inline constexpr Field kCtcif5{11, 1};
inline constexpr Field kCfeif6{16, 1};
inline constexpr Field kCdmeif6{18, 1};
inline constexpr Field kCteif6{19, 1};
inline constexpr Field kChtif6{20, 1};
inline constexpr Field kCtcif6{21, 1};
inline constexpr Field kCfeif7{22, 1};
inline constexpr Field kCdmeif7{24, 1};
inline constexpr Field kCteif7{25, 1};
inline constexpr Field kChtif7{26, 1};
inline constexpr Field kCtcif7{27, 1};
}
/// DMA1.S#CR: stream x configuration register
namespace sxcr {
inline constexpr std::uint32_t kOffset = 0x010;
inline constexpr std::uint32_t kStride = 0x18, kCount = 8;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kEn{0, 1};
inline constexpr Field kDmeie{1, 1};
inline constexpr Field kTeie{2, 1};
inline constexpr Field kHtie{3, 1};
inline constexpr Field kTcie{4, 1};
inline constexpr Field kPfctrl{5, 1};
inline constexpr Field kDir{6, 2};
inline constexpr Field kCirc{8, 1};
inline constexpr Field kPinc{9, 1};
inline constexpr Field kMinc{10, 1};
inline constexpr Field kPsize{11, 2};
inline constexpr Field kMsize{13, 2};
inline constexpr Field kPl{16, 2};
inline constexpr Field kDbm{18, 1};
inline constexpr Field kCt{19, 1};
inline constexpr Field kPburst{21, 2};
inline constexpr Field kMburst{23, 2};
inline constexpr Field kChsel{25, 3};
}
/// DMA1.S#NDTR: stream x number of data register
namespace sxndtr {
inline constexpr std::uint32_t kOffset = 0x014;
inline constexpr std::uint32_t kStride = 0x18, kCount = 8;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kNdt{0, 16};
}
/// DMA1.S#PAR: stream x peripheral address register
namespace sxpar {
inline constexpr std::uint32_t kOffset = 0x018;
inline constexpr std::uint32_t kStride = 0x18, kCount = 8;
inline constexpr std::uint32_t kResetValue = 0x00000000;
}
/// DMA1.S#M0AR: stream x memory 0 address register
namespace sxm0ar {
inline constexpr std::uint32_t kOffset = 0x01C;
inline constexpr std::uint32_t kStride = 0x18, kCount = 8;
inline constexpr std::uint32_t kResetValue = 0x00000000;
}
/// DMA1.S#FCR: stream x FIFO control register
namespace sxfcr {
inline constexpr std::uint32_t kOffset = 0x024;
inline constexpr std::uint32_t kStride = 0x18, kCount = 8;
inline constexpr std::uint32_t kResetValue = 0x00000021;
inline constexpr Field kFth{0, 2};
inline constexpr Field kDmdis{2, 1};
inline constexpr Field kFs{3, 3};
inline constexpr Field kFeie{7, 1};
}
}  // namespace dma

}  // namespace tetap::hal::stm32f412
