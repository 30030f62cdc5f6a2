// SPDX-License-Identifier: Apache-2.0
// clang-format off
// Generated from STM32G474.svd by tools/run/generate_registers with registers_stm32g474.toml: not to be edited.
// STM32G474 version 2.9, sha256 b9d75d8f197df0ecd11d60885862da166f31878cf18d1b5c5e126ab675130281.
// Names, offsets, bit positions and descriptions: Copyright (c) 2024 STMicroelectronics, Apache-2.0.
#pragma once

#include "hal/chip/support/register_field.hpp"

#include <cstdint>

namespace tetap::hal::stm32g474 {

/// Numbers of the interrupts in the NVIC.
namespace interrupt {
inline constexpr int kDma1Ch1 = 11;
inline constexpr int kFdcan1It0 = 21;
inline constexpr int kFdcan1It1 = 22;
inline constexpr int kUsart1 = 37;
inline constexpr int kUsart2 = 38;
inline constexpr int kSpi1 = 35;
inline constexpr int kTim2 = 28;
inline constexpr int kTim3 = 29;
inline constexpr int kExti0 = 6;
inline constexpr int kExti1 = 7;
inline constexpr int kExti2 = 8;
inline constexpr int kExti3 = 9;
inline constexpr int kExti4 = 10;
inline constexpr int kExti95 = 23;
inline constexpr int kExti1510 = 40;
inline constexpr int kDma1Ch2 = 12;
inline constexpr int kDma1Ch3 = 13;
inline constexpr int kDma1Ch4 = 14;
inline constexpr int kDma1Ch5 = 15;
inline constexpr int kDma1Ch6 = 16;
inline constexpr int kDma1Ch7 = 17;
inline constexpr int kDma1Ch8 = 96;
inline constexpr int kDma2Ch1 = 56;
inline constexpr int kDma2Ch2 = 57;
inline constexpr int kDma2Ch3 = 58;
inline constexpr int kDma2Ch4 = 59;
inline constexpr int kDma2Ch5 = 60;
inline constexpr int kDma2Ch6 = 97;
inline constexpr int kDma2Ch7 = 98;
inline constexpr int kDma2Ch8 = 99;
}  // namespace interrupt

namespace rcc {
inline constexpr std::uint32_t kRcc = 0x40021000;  ///< base address
/// RCC.CR: Clock control register
namespace cr {
inline constexpr std::uint32_t kOffset = 0x000;
inline constexpr std::uint32_t kResetValue = 0x00000063;
inline constexpr Field kHsion{8, 1};
inline constexpr Field kHsirdy{10, 1};
inline constexpr Field kHseon{16, 1};
inline constexpr Field kHserdy{17, 1};
inline constexpr Field kHsebyp{18, 1};
inline constexpr Field kCsson{19, 1};
inline constexpr Field kPllon{24, 1};
inline constexpr Field kPllrdy{25, 1};
}
/// RCC.CFGR: Clock configuration register
namespace cfgr {
inline constexpr std::uint32_t kOffset = 0x008;
inline constexpr std::uint32_t kResetValue = 0x00000005;
inline constexpr Field kSw{0, 2};
inline constexpr Field kSws{2, 2};
inline constexpr Field kHpre{4, 4};
inline constexpr Field kPpre1{8, 3};
inline constexpr Field kPpre2{11, 3};
}
/// RCC.PLLCFGR: PLL configuration register
namespace pllcfgr {
inline constexpr std::uint32_t kOffset = 0x00C;
inline constexpr std::uint32_t kResetValue = 0x00001000;
inline constexpr Field kPllsrc{0, 2};
inline constexpr Field kPllm{4, 4};
inline constexpr Field kPlln{8, 7};
inline constexpr Field kPllren{24, 1};
inline constexpr Field kPllr{25, 2};
inline constexpr Field kPllpen{16, 1};
inline constexpr Field kPllp{17, 1};
inline constexpr Field kPllqen{20, 1};
inline constexpr Field kPllq{21, 2};
inline constexpr Field kPllpdiv{27, 5};
}
/// RCC.AHB1RSTR: AHB1 peripheral reset register
namespace ahb1rstr {
inline constexpr std::uint32_t kOffset = 0x028;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kDma1rst{0, 1};
inline constexpr Field kDmamux1rst{2, 1};
inline constexpr Field kDma2rst{1, 1};
}
/// RCC.APB1RSTR1: APB1 peripheral reset register 1
namespace apb1rstr1 {
inline constexpr std::uint32_t kOffset = 0x038;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kTim2rst{0, 1};
inline constexpr Field kTim3rst{1, 1};
inline constexpr Field kUsart2rst{17, 1};
inline constexpr Field kFdcanrst{25, 1};
inline constexpr Field kPwrrst{28, 1};
}
/// RCC.APB2RSTR: APB2 peripheral reset register
namespace apb2rstr {
inline constexpr std::uint32_t kOffset = 0x040;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kSpi1rst{12, 1};
inline constexpr Field kUsart1rst{14, 1};
inline constexpr Field kSyscfgrst{0, 1};
}
/// RCC.AHB1ENR: AHB1 peripheral clock enable register
namespace ahb1enr {
inline constexpr std::uint32_t kOffset = 0x048;
inline constexpr std::uint32_t kResetValue = 0x00000100;
inline constexpr Field kDma1en{0, 1};
inline constexpr Field kDmamux1en{2, 1};
inline constexpr Field kDma2en{1, 1};
inline constexpr Field kFlashen{8, 1};
}
/// RCC.AHB2ENR: AHB2 peripheral clock enable register
namespace ahb2enr {
inline constexpr std::uint32_t kOffset = 0x04C;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kGpioaen{0, 1};
inline constexpr Field kGpioben{1, 1};
inline constexpr Field kGpiocen{2, 1};
}
/// RCC.APB1ENR1: APB1 peripheral clock enable register 1
namespace apb1enr1 {
inline constexpr std::uint32_t kOffset = 0x058;
inline constexpr std::uint32_t kResetValue = 0x00000400;
inline constexpr Field kTim2en{0, 1};
inline constexpr Field kTim3en{1, 1};
inline constexpr Field kUsart2en{17, 1};
inline constexpr Field kFdcanen{25, 1};
inline constexpr Field kPwren{28, 1};
}
/// RCC.APB2ENR: APB2 peripheral clock enable register
namespace apb2enr {
inline constexpr std::uint32_t kOffset = 0x060;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kSpi1en{12, 1};
inline constexpr Field kUsart1en{14, 1};
inline constexpr Field kSyscfgen{0, 1};
}
/// RCC.CCIPR: Peripherals independent clock configuration register
namespace ccipr {
inline constexpr std::uint32_t kOffset = 0x088;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kFdcansel{24, 2};
inline constexpr Field kUsart1sel{0, 2};
inline constexpr Field kUsart2sel{2, 2};
}
/// RCC.CSR: Control/status register
namespace csr {
inline constexpr std::uint32_t kOffset = 0x094;
inline constexpr std::uint32_t kResetValue = 0x0C000000;
inline constexpr Field kRmvf{23, 1};
inline constexpr Field kPinrstf{26, 1};
inline constexpr Field kBorrstf{27, 1};
inline constexpr Field kSftrstf{28, 1};
inline constexpr Field kIwdgrstf{29, 1};
inline constexpr Field kWwdgrstf{30, 1};
inline constexpr Field kLpwrrstf{31, 1};
inline constexpr Field kLsion{0, 1};
inline constexpr Field kLsirdy{1, 1};
}
/// RCC.AHB2RSTR: AHB2 peripheral reset register
namespace ahb2rstr {
inline constexpr std::uint32_t kOffset = 0x02C;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kGpioarst{0, 1};
inline constexpr Field kGpiobrst{1, 1};
inline constexpr Field kGpiocrst{2, 1};
}
}  // namespace rcc

namespace pwr {
inline constexpr std::uint32_t kPwr = 0x40007000;  ///< base address
/// PWR.CR1: Power control register 1
namespace cr1 {
inline constexpr std::uint32_t kOffset = 0x000;
inline constexpr std::uint32_t kResetValue = 0x00000200;
inline constexpr Field kVos{9, 2};
inline constexpr Field kLpr{14, 1};
}
/// PWR.CR3: Power control register 3
namespace cr3 {
inline constexpr std::uint32_t kOffset = 0x008;
inline constexpr std::uint32_t kResetValue = 0x00008000;
inline constexpr Field kUcpd1Dbdis{14, 1};
}
/// PWR.CR5: Power control register
namespace cr5 {
inline constexpr std::uint32_t kOffset = 0x080;
inline constexpr std::uint32_t kResetValue = 0x00000100;
inline constexpr Field kR1mode{8, 1};
}
/// PWR.SR2: Power status register 2
namespace sr2 {
inline constexpr std::uint32_t kOffset = 0x014;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kVosf{10, 1};
}
}  // namespace pwr

namespace flash {
inline constexpr std::uint32_t kFlash = 0x40022000;  ///< base address
/// FLASH.ACR: Flash access control register
namespace acr {
inline constexpr std::uint32_t kOffset = 0x000;
inline constexpr std::uint32_t kResetValue = 0x00040601;
inline constexpr Field kLatency{0, 4};
inline constexpr Field kPrften{8, 1};
inline constexpr Field kIcen{9, 1};
inline constexpr Field kDcen{10, 1};
inline constexpr Field kIcrst{11, 1};
inline constexpr Field kDcrst{12, 1};
}
/// FLASH.KEYR: Flash key register
namespace keyr {
inline constexpr std::uint32_t kOffset = 0x008;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kKeyr{0, 32};
}
/// FLASH.SR: Flash status register
namespace sr {
inline constexpr std::uint32_t kOffset = 0x010;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kEop{0, 1};
inline constexpr Field kOperr{1, 1};
inline constexpr Field kProgerr{3, 1};
inline constexpr Field kWrperr{4, 1};
inline constexpr Field kPgaerr{5, 1};
inline constexpr Field kSizerr{6, 1};
inline constexpr Field kPgserr{7, 1};
inline constexpr Field kMisserr{8, 1};
inline constexpr Field kFasterr{9, 1};
inline constexpr Field kRderr{14, 1};
inline constexpr Field kOptverr{15, 1};
inline constexpr Field kBsy{16, 1};
}
/// FLASH.CR: Flash control register
namespace cr {
inline constexpr std::uint32_t kOffset = 0x014;
inline constexpr std::uint32_t kResetValue = 0xC0000000;
inline constexpr Field kPg{0, 1};
inline constexpr Field kPer{1, 1};
inline constexpr Field kMer1{2, 1};
inline constexpr Field kPnb{3, 7};
inline constexpr Field kBker{11, 1};
inline constexpr Field kMer2{15, 1};
inline constexpr Field kStart{16, 1};
inline constexpr Field kFstpg{18, 1};
inline constexpr Field kEopie{24, 1};
inline constexpr Field kErrie{25, 1};
inline constexpr Field kLock{31, 1};
}
/// FLASH.ECCR: Flash ECC register
namespace eccr {
inline constexpr std::uint32_t kOffset = 0x018;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kAddrEcc{0, 19};
inline constexpr Field kBkEcc{21, 1};
inline constexpr Field kSysfEcc{22, 1};
inline constexpr Field kEcccie{24, 1};
inline constexpr Field kEccc2{28, 1};
inline constexpr Field kEccd2{29, 1};
inline constexpr Field kEccc{30, 1};
inline constexpr Field kEccd{31, 1};
}
/// FLASH.OPTR: 
namespace optr {
inline constexpr std::uint32_t kOffset = 0x020;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kDbank{22, 1};
}
}  // namespace flash

namespace gpio {
inline constexpr std::uint32_t kGpioa = 0x48000000;  ///< base address
inline constexpr std::uint32_t kGpiob = 0x48000400;  ///< base address
inline constexpr std::uint32_t kGpioc = 0x48000800;  ///< base address
/// GPIOA.MODER: GPIO port mode register
namespace moder {
inline constexpr std::uint32_t kOffset = 0x000;
inline constexpr std::uint32_t kResetValueGpioa = 0xABFFFFFF;
inline constexpr std::uint32_t kResetValueGpiob = 0xFFFFFEBF;
inline constexpr std::uint32_t kResetValueGpioc = 0xFFFFFFFF;
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
inline constexpr std::uint32_t kResetValueGpioa = 0x0C000000;
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
/// GPIOA.IDR: GPIO port input data register
namespace idr {
inline constexpr std::uint32_t kOffset = 0x010;
inline constexpr std::uint32_t kResetValue = 0x00000000;
}
/// GPIOA.ODR: GPIO port output data register
namespace odr {
inline constexpr std::uint32_t kOffset = 0x014;
inline constexpr std::uint32_t kResetValue = 0x00000000;
}
/// GPIOA.BRR: GPIO port bit reset register
namespace brr {
inline constexpr std::uint32_t kOffset = 0x028;
inline constexpr std::uint32_t kResetValue = 0x00000000;
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
inline constexpr Field kLsbfirst{7, 1};
inline constexpr Field kRxonly{10, 1};
inline constexpr Field kCrcen{13, 1};
inline constexpr Field kBidimode{15, 1};
}
/// SPI1.CR2: control register 2
namespace cr2 {
inline constexpr std::uint32_t kOffset = 0x004;
inline constexpr std::uint32_t kResetValue = 0x00000700;
inline constexpr Field kDs{8, 4};
inline constexpr Field kFrxth{12, 1};
inline constexpr Field kRxdmaen{0, 1};
inline constexpr Field kTxdmaen{1, 1};
inline constexpr Field kSsoe{2, 1};
inline constexpr Field kNssp{3, 1};
inline constexpr Field kFrf{4, 1};
inline constexpr Field kErrie{5, 1};
inline constexpr Field kRxneie{6, 1};
inline constexpr Field kTxeie{7, 1};
inline constexpr Field kLdmaRx{13, 1};
inline constexpr Field kLdmaTx{14, 1};
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
inline constexpr Field kFrlvl{9, 2};
inline constexpr Field kFtlvl{11, 2};
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
/// TIM2.CR1: TIM2 control register 1
namespace cr1 {
inline constexpr std::uint32_t kOffset = 0x000;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kCen{0, 1};
inline constexpr Field kUifremap{11, 1};
inline constexpr Field kDithen{12, 1};
}
/// TIM2.SMCR: TIM2 slave mode control register
namespace smcr {
inline constexpr std::uint32_t kOffset = 0x008;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kSms{0, 3};
inline constexpr Field kSms1{16, 1};
inline constexpr Field kSmspe{24, 1};
}
/// TIM2.CCMR1: TIM2 capture/compare mode register 1 [alternate]
namespace ccmr1 {
inline constexpr std::uint32_t kOffset = 0x018;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kCc1s{0, 2};
inline constexpr Field kIc1f{4, 4};
inline constexpr Field kCc2s{8, 2};
inline constexpr Field kIc2f{12, 4};
}
/// TIM2.CCER: TIM2 capture/compare enable register
namespace ccer {
inline constexpr std::uint32_t kOffset = 0x020;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kCc1p{1, 1};
inline constexpr Field kCc2p{5, 1};
}
/// TIM2.CNT: TIM2 counter
namespace cnt {
inline constexpr std::uint32_t kOffset = 0x024;
inline constexpr std::uint32_t kResetValue = 0x00000000;
}
/// TIM2.PSC: TIM2 prescaler
namespace psc {
inline constexpr std::uint32_t kOffset = 0x028;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kPsc{0, 16};
}
/// TIM2.ARR: TIM2 auto-reload register
namespace arr {
inline constexpr std::uint32_t kOffset = 0x02C;
inline constexpr std::uint32_t kResetValueTim2 = 0xFFFFFFFF;
inline constexpr std::uint32_t kResetValueTim3 = 0x0000FFFF;
}
/// TIM2.EGR: TIM2 event generation register
namespace egr {
inline constexpr std::uint32_t kOffset = 0x014;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kUg{0, 1};
}
}  // namespace tim

namespace usart {
inline constexpr std::uint32_t kUsart1 = 0x40013800;  ///< base address
inline constexpr std::uint32_t kUsart2 = 0x40004400;  ///< base address
/// USART1.CR1: Control register 1
namespace cr1 {
inline constexpr std::uint32_t kOffset = 0x000;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kUe{0, 1};
inline constexpr Field kRe{2, 1};
inline constexpr Field kTe{3, 1};
inline constexpr Field kIdleie{4, 1};
inline constexpr Field kRxneie{5, 1};
inline constexpr Field kTcie{6, 1};
inline constexpr Field kTxeie{7, 1};
inline constexpr Field kPce{10, 1};
inline constexpr Field kM0{12, 1};
inline constexpr Field kOver8{15, 1};
inline constexpr Field kM1{28, 1};
inline constexpr Field kFifoen{29, 1};
}
/// USART1.CR2: Control register 2
namespace cr2 {
inline constexpr std::uint32_t kOffset = 0x004;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kStop{12, 2};
}
/// USART1.CR3: Control register 3
namespace cr3 {
inline constexpr std::uint32_t kOffset = 0x008;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kEie{0, 1};
inline constexpr Field kDmar{6, 1};
inline constexpr Field kDmat{7, 1};
inline constexpr Field kOnebit{11, 1};
inline constexpr Field kOvrdis{12, 1};
}
/// USART1.BRR: Baud rate register
namespace brr {
inline constexpr std::uint32_t kOffset = 0x00C;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kDivFraction{0, 4};
inline constexpr Field kDivMantissa{4, 12};
}
/// USART1.ISR: Interrupt & status register
namespace isr {
inline constexpr std::uint32_t kOffset = 0x01C;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kPe{0, 1};
inline constexpr Field kFe{1, 1};
inline constexpr Field kNf{2, 1};
inline constexpr Field kOre{3, 1};
inline constexpr Field kRxne{5, 1};
inline constexpr Field kTc{6, 1};
inline constexpr Field kTxe{7, 1};
inline constexpr Field kIdle{4, 1};
inline constexpr Field kBusy{16, 1};
inline constexpr Field kTeack{21, 1};
inline constexpr Field kReack{22, 1};
}
/// USART1.ICR: Interrupt flag clear register
namespace icr {
inline constexpr std::uint32_t kOffset = 0x020;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kPecf{0, 1};
inline constexpr Field kFecf{1, 1};
inline constexpr Field kNcf{2, 1};
inline constexpr Field kOrecf{3, 1};
inline constexpr Field kTccf{6, 1};
inline constexpr Field kIdlecf{4, 1};
}
/// USART1.RDR: Receive data register
namespace rdr {
inline constexpr std::uint32_t kOffset = 0x024;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kRdr{0, 9};
}
/// USART1.TDR: Transmit data register
namespace tdr {
inline constexpr std::uint32_t kOffset = 0x028;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kTdr{0, 9};
}
/// USART1.RQR: Request register
namespace rqr {
inline constexpr std::uint32_t kOffset = 0x018;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kRxfrq{3, 1};
inline constexpr Field kTxfrq{4, 1};
}
/// USART1.PRESC: USART prescaler register
namespace presc {
inline constexpr std::uint32_t kOffset = 0x02C;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kPrescaler{0, 4};
}
}  // namespace usart

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
/// IWDG.WINR: Window register
namespace winr {
inline constexpr std::uint32_t kOffset = 0x010;
inline constexpr std::uint32_t kResetValue = 0x00000FFF;
}
}  // namespace iwdg

namespace dma {
inline constexpr std::uint32_t kDma1 = 0x40020000;  ///< base address
inline constexpr std::uint32_t kDma2 = 0x40020400;  ///< base address
/// DMA1.ISR: interrupt status register
namespace isr {
inline constexpr std::uint32_t kOffset = 0x000;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kTcif1{1, 1};
inline constexpr Field kTcif2{5, 1};
inline constexpr Field kGif1{0, 1};
inline constexpr Field kHtif1{2, 1};
inline constexpr Field kTeif1{3, 1};
}
/// DMA1.IFCR: DMA interrupt flag clear register
namespace ifcr {
inline constexpr std::uint32_t kOffset = 0x004;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kGif1{0, 1};
inline constexpr Field kTcif1{1, 1};
inline constexpr Field kHtif1{2, 1};
inline constexpr Field kTeif1{3, 1};
inline constexpr Field kGif2{4, 1};
}
/// DMA1.CCR#: DMA channel 1 configuration register
namespace ccrx {
inline constexpr std::uint32_t kOffset = 0x008;
inline constexpr std::uint32_t kStride = 0x14, kCount = 8;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kEn{0, 1};
inline constexpr Field kTcie{1, 1};
inline constexpr Field kDir{4, 1};
inline constexpr Field kCirc{5, 1};
inline constexpr Field kMinc{7, 1};
inline constexpr Field kPsize{8, 2};
inline constexpr Field kMsize{10, 2};
inline constexpr Field kPl{12, 2};
inline constexpr Field kHtie{2, 1};
inline constexpr Field kTeie{3, 1};
inline constexpr Field kPinc{6, 1};
inline constexpr Field kMem2mem{14, 1};
}
/// DMA1.CNDTR#: channel x number of data to transfer register
namespace cndtrx {
inline constexpr std::uint32_t kOffset = 0x00C;
inline constexpr std::uint32_t kStride = 0x14, kCount = 8;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kNdt{0, 16};
}
/// DMA1.CPAR#: DMA channel x peripheral address register
namespace cparx {
inline constexpr std::uint32_t kOffset = 0x010;
inline constexpr std::uint32_t kStride = 0x14, kCount = 8;
inline constexpr std::uint32_t kResetValue = 0x00000000;
}
/// DMA1.CMAR#: DMA channel x memory address register
namespace cmarx {
inline constexpr std::uint32_t kOffset = 0x014;
inline constexpr std::uint32_t kStride = 0x14, kCount = 8;
inline constexpr std::uint32_t kResetValue = 0x00000000;
}
}  // namespace dma

namespace dmamux {
inline constexpr std::uint32_t kDmamux = 0x40020800;  ///< base address
/// DMAMUX.C#CR: DMAMux - DMA request line multiplexer channel x control register
namespace cxcr {
inline constexpr std::uint32_t kOffset = 0x000;
inline constexpr std::uint32_t kStride = 0x04, kCount = 16;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kDmareqId{0, 7};
inline constexpr Field kSoie{8, 1};
inline constexpr Field kEge{9, 1};
inline constexpr Field kSe{16, 1};
}
}  // namespace dmamux

namespace fdcan {
inline constexpr std::uint32_t kFdcan1 = 0x40006400;  ///< base address
inline constexpr std::uint32_t kFdcan = 0x4000A400;  ///< base address
/// FDCAN1.CCCR: FDCAN CC control register
namespace cccr {
inline constexpr std::uint32_t kOffset = 0x018;
inline constexpr std::uint32_t kResetValue = 0x00000001;
inline constexpr Field kInit{0, 1};
inline constexpr Field kCce{1, 1};
inline constexpr Field kAsm{2, 1};
inline constexpr Field kCsa{3, 1};
inline constexpr Field kCsr{4, 1};
inline constexpr Field kMon{5, 1};
inline constexpr Field kDar{6, 1};
inline constexpr Field kTest{7, 1};
inline constexpr Field kFdoe{8, 1};
inline constexpr Field kBrse{9, 1};
inline constexpr Field kPxhd{12, 1};
inline constexpr Field kEfbi{13, 1};
inline constexpr Field kTxp{14, 1};
inline constexpr Field kNiso{15, 1};
}
/// FDCAN1.NBTP: FDCAN nominal bit timing and prescaler register
namespace nbtp {
inline constexpr std::uint32_t kOffset = 0x01C;
inline constexpr std::uint32_t kResetValue = 0x06000A03;
inline constexpr Field kNtseg2{0, 7};
inline constexpr Field kNtseg1{8, 8};
inline constexpr Field kNbrp{16, 9};
inline constexpr Field kNsjw{25, 7};
}
/// FDCAN1.PSR: FDCAN protocol status register
namespace psr {
inline constexpr std::uint32_t kOffset = 0x044;
inline constexpr std::uint32_t kResetValue = 0x00000707;
inline constexpr Field kAct{3, 2};
inline constexpr Field kEp{5, 1};
inline constexpr Field kBo{7, 1};
inline constexpr Field kLec{0, 3};
inline constexpr Field kEw{6, 1};
inline constexpr Field kDlec{8, 3};
}
/// FDCAN1.IR: FDCAN interrupt register
namespace ir {
inline constexpr std::uint32_t kOffset = 0x050;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kRf0n{0, 1};
inline constexpr Field kRf0l{2, 1};
inline constexpr Field kTc{7, 1};
inline constexpr Field kRf0f{1, 1};
inline constexpr Field kRf1n{3, 1};
inline constexpr Field kRf1f{4, 1};
inline constexpr Field kRf1l{5, 1};
inline constexpr Field kHpm{6, 1};
inline constexpr Field kTcf{8, 1};
inline constexpr Field kTfe{9, 1};
inline constexpr Field kTefn{10, 1};
inline constexpr Field kTeff{11, 1};
inline constexpr Field kTefl{12, 1};
inline constexpr Field kTsw{13, 1};
inline constexpr Field kMraf{14, 1};
inline constexpr Field kToo{15, 1};
inline constexpr Field kElo{16, 1};
inline constexpr Field kEp{17, 1};
inline constexpr Field kEw{18, 1};
inline constexpr Field kBo{19, 1};
inline constexpr Field kWdi{20, 1};
inline constexpr Field kPea{21, 1};
inline constexpr Field kPed{22, 1};
inline constexpr Field kAra{23, 1};
}
/// FDCAN1.IE: FDCAN interrupt enable register
namespace ie {
inline constexpr std::uint32_t kOffset = 0x054;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kRf0ne{0, 1};
inline constexpr Field kTce{7, 1};
}
/// FDCAN1.ILS: FDCAN interrupt line select register
namespace ils {
inline constexpr std::uint32_t kOffset = 0x058;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kSmsg{2, 1};
inline constexpr Field kRxfifo0{0, 1};
inline constexpr Field kRxfifo1{1, 1};
inline constexpr Field kTferr{3, 1};
inline constexpr Field kMisc{4, 1};
inline constexpr Field kBerr{5, 1};
inline constexpr Field kPerr{6, 1};
}
/// FDCAN1.ILE: FDCAN interrupt line enable register
namespace ile {
inline constexpr std::uint32_t kOffset = 0x05C;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kEint0{0, 1};
inline constexpr Field kEint1{1, 1};
}
/// FDCAN1.RXGFC: FDCAN global filter configuration register
namespace rxgfc {
inline constexpr std::uint32_t kOffset = 0x080;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kRrfe{0, 1};
inline constexpr Field kRrfs{1, 1};
inline constexpr Field kAnfe{2, 2};
inline constexpr Field kAnfs{4, 2};
inline constexpr Field kF0om{9, 1};
inline constexpr Field kLss{16, 5};
inline constexpr Field kLse{24, 4};
inline constexpr Field kF1om{8, 1};
}
/// FDCAN1.RXF0S: FDCAN Rx FIFO 0 status register
namespace rxf0s {
inline constexpr std::uint32_t kOffset = 0x090;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kF0fl{0, 4};
inline constexpr Field kF0gi{8, 2};
inline constexpr Field kF0pi{16, 2};
inline constexpr Field kF0f{24, 1};
inline constexpr Field kRf0l{25, 1};
}
/// FDCAN1.RXF0A: CAN Rx FIFO 0 acknowledge register
namespace rxf0a {
inline constexpr std::uint32_t kOffset = 0x094;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kF0ai{0, 3};
}
/// FDCAN1.TXBC: FDCAN Tx buffer configuration register
namespace txbc {
inline constexpr std::uint32_t kOffset = 0x0C0;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kTfqm{24, 1};
}
/// FDCAN1.TXFQS: FDCAN Tx FIFO/queue status register
namespace txfqs {
inline constexpr std::uint32_t kOffset = 0x0C4;
inline constexpr std::uint32_t kResetValue = 0x00000003;
inline constexpr Field kTffl{0, 3};
inline constexpr Field kTfqpi{16, 2};
inline constexpr Field kTfgi{8, 2};
inline constexpr Field kTfqf{21, 1};
}
/// FDCAN1.TXBAR: FDCAN Tx buffer add request register
namespace txbar {
inline constexpr std::uint32_t kOffset = 0x0CC;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kAr{0, 3};
}
/// FDCAN1.TXBCR: FDCAN Tx buffer cancellation request register
namespace txbcr {
inline constexpr std::uint32_t kOffset = 0x0D0;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kCr{0, 3};
}
/// FDCAN1.TXBTIE: FDCAN Tx buffer transmission interrupt enable register
namespace txbtie {
inline constexpr std::uint32_t kOffset = 0x0DC;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kTie{0, 3};
}
/// FDCAN1.CKDIV: FDCAN CFG clock divider register
namespace ckdiv {
inline constexpr std::uint32_t kOffset = 0x100;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kPdiv{0, 4};
}
/// FDCAN1.CREL: FDCAN core release register
namespace crel {
inline constexpr std::uint32_t kOffset = 0x000;
inline constexpr std::uint32_t kResetValue = 0x32141218;
}
/// FDCAN1.ENDN: FDCAN endian register
namespace endn {
inline constexpr std::uint32_t kOffset = 0x004;
inline constexpr std::uint32_t kResetValue = 0x87654321;
}
/// FDCAN1.DBTP: FDCAN data bit timing and prescaler register
namespace dbtp {
inline constexpr std::uint32_t kOffset = 0x00C;
inline constexpr std::uint32_t kResetValue = 0x00000A33;
}
/// FDCAN1.TEST: FDCAN test register
namespace test {
inline constexpr std::uint32_t kOffset = 0x010;
inline constexpr std::uint32_t kResetValue = 0x00000000;
}
/// FDCAN1.RWD: FDCAN RAM watchdog register
namespace rwd {
inline constexpr std::uint32_t kOffset = 0x014;
inline constexpr std::uint32_t kResetValue = 0x00000000;
}
/// FDCAN1.TSCC: FDCAN timestamp counter configuration register
namespace tscc {
inline constexpr std::uint32_t kOffset = 0x020;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kTss{0, 2};
inline constexpr Field kTcp{16, 4};
}
/// FDCAN1.TSCV: FDCAN timestamp counter value register
namespace tscv {
inline constexpr std::uint32_t kOffset = 0x024;
inline constexpr std::uint32_t kResetValue = 0x00000000;
}
/// FDCAN1.TOCC: FDCAN timeout counter configuration register
namespace tocc {
inline constexpr std::uint32_t kOffset = 0x028;
inline constexpr std::uint32_t kResetValue = 0xFFFF0000;
inline constexpr Field kEtoc{0, 1};
}
/// FDCAN1.TOCV: FDCAN timeout counter value register
namespace tocv {
inline constexpr std::uint32_t kOffset = 0x02C;
inline constexpr std::uint32_t kResetValue = 0x0000FFFF;
}
/// FDCAN1.ECR: FDCAN error counter register
namespace ecr {
inline constexpr std::uint32_t kOffset = 0x040;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kTec{0, 8};
inline constexpr Field kRec{8, 7};
inline constexpr Field kRp{15, 1};
inline constexpr Field kCel{16, 8};
}
/// FDCAN1.TDCR: FDCAN transmitter delay compensation register
namespace tdcr {
inline constexpr std::uint32_t kOffset = 0x048;
inline constexpr std::uint32_t kResetValue = 0x00000000;
}
/// FDCAN1.XIDAM: FDCAN extended ID and mask register
namespace xidam {
inline constexpr std::uint32_t kOffset = 0x084;
inline constexpr std::uint32_t kResetValue = 0x1FFFFFFF;
}
/// FDCAN1.HPMS: FDCAN high-priority message status register
namespace hpms {
inline constexpr std::uint32_t kOffset = 0x088;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kBidx{0, 3};
inline constexpr Field kMsi{6, 2};
inline constexpr Field kFidx{8, 5};
inline constexpr Field kFlst{15, 1};
}
/// FDCAN1.RXF1S: FDCAN Rx FIFO 1 status register
namespace rxf1s {
inline constexpr std::uint32_t kOffset = 0x098;
inline constexpr std::uint32_t kResetValue = 0x00000000;
}
/// FDCAN1.RXF1A: FDCAN Rx FIFO 1 acknowledge register
namespace rxf1a {
inline constexpr std::uint32_t kOffset = 0x09C;
inline constexpr std::uint32_t kResetValue = 0x00000000;
}
/// FDCAN1.TXBRP: FDCAN Tx buffer request pending register
namespace txbrp {
inline constexpr std::uint32_t kOffset = 0x0C8;
inline constexpr std::uint32_t kResetValue = 0x00000000;
}
/// FDCAN1.TXBTO: FDCAN Tx buffer transmission occurred register
namespace txbto {
inline constexpr std::uint32_t kOffset = 0x0D4;
inline constexpr std::uint32_t kResetValue = 0x00000000;
}
/// FDCAN1.TXBCF: FDCAN Tx buffer cancellation finished register
namespace txbcf {
inline constexpr std::uint32_t kOffset = 0x0D8;
inline constexpr std::uint32_t kResetValue = 0x00000000;
}
/// FDCAN1.TXBCIE: FDCAN Tx buffer cancellation finished interrupt enable register
namespace txbcie {
inline constexpr std::uint32_t kOffset = 0x0E0;
inline constexpr std::uint32_t kResetValue = 0x00000000;
}
/// FDCAN1.TXEFS: FDCAN Tx event FIFO status register
namespace txefs {
inline constexpr std::uint32_t kOffset = 0x0E4;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kEffl{0, 3};
inline constexpr Field kEfgi{8, 2};
inline constexpr Field kEfpi{16, 2};
inline constexpr Field kEff{24, 1};
inline constexpr Field kTefl{25, 1};
}
/// FDCAN1.TXEFA: FDCAN Tx event FIFO acknowledge register
namespace txefa {
inline constexpr std::uint32_t kOffset = 0x0E8;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kEfai{0, 2};
}
}  // namespace fdcan

namespace syscfg {
inline constexpr std::uint32_t kSyscfg = 0x40010000;  ///< base address
/// SYSCFG.EXTICR#: external interrupt configuration register 1
namespace exticrx {
inline constexpr std::uint32_t kOffset = 0x008;
inline constexpr std::uint32_t kStride = 0x04, kCount = 4;
inline constexpr std::uint32_t kResetValue = 0x00000000;
}
}  // namespace syscfg

namespace exti {
inline constexpr std::uint32_t kExti = 0x40010400;  ///< base address
/// EXTI.IMR1: Interrupt mask register
namespace imr1 {
inline constexpr std::uint32_t kOffset = 0x000;
inline constexpr std::uint32_t kResetValue = 0xFF820000;
}
/// EXTI.EMR1: Event mask register
namespace emr1 {
inline constexpr std::uint32_t kOffset = 0x004;
inline constexpr std::uint32_t kResetValue = 0x00000000;
}
/// EXTI.RTSR1: Rising Trigger selection register
namespace rtsr1 {
inline constexpr std::uint32_t kOffset = 0x008;
inline constexpr std::uint32_t kResetValue = 0x00000000;
}
/// EXTI.FTSR1: Falling Trigger selection register
namespace ftsr1 {
inline constexpr std::uint32_t kOffset = 0x00C;
inline constexpr std::uint32_t kResetValue = 0x00000000;
}
/// EXTI.SWIER1: Software interrupt event register
namespace swier1 {
inline constexpr std::uint32_t kOffset = 0x010;
inline constexpr std::uint32_t kResetValue = 0x00000000;
}
/// EXTI.PR1: Pending register
namespace pr1 {
inline constexpr std::uint32_t kOffset = 0x014;
inline constexpr std::uint32_t kResetValue = 0x00000000;
}
}  // namespace exti

}  // namespace tetap::hal::stm32g474
