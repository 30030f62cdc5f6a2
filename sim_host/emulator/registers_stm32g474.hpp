// SPDX-License-Identifier: Apache-2.0
// clang-format off
// Generated from STM32G474.svd by tools/run/generate_registers with registers_stm32g474.toml: not to be edited.
// STM32G474 version 2.9, sha256 b9d75d8f197df0ecd11d60885862da166f31878cf18d1b5c5e126ab675130281.
// Names, offsets, bit positions and descriptions: Copyright (c) 2024 STMicroelectronics, Apache-2.0.
#pragma once

#include "hal/chip/support/register_field.hpp"

#include <cstdint>

namespace tetap::hal::stm32g474_model {

/// Numbers of the interrupts in the NVIC.
namespace interrupt {
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
inline constexpr int kDma1Ch1 = 11;
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
/// RCC.RCC_CR: Clock control register
namespace rcc_cr {
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
/// RCC.RCC_CFGR: Clock configuration register
namespace rcc_cfgr {
inline constexpr std::uint32_t kOffset = 0x008;
inline constexpr std::uint32_t kResetValue = 0x00000005;
inline constexpr Field kSw{0, 2};
inline constexpr Field kSws{2, 2};
inline constexpr Field kHpre{4, 4};
inline constexpr Field kPpre1{8, 3};
inline constexpr Field kPpre2{11, 3};
}
/// RCC.RCC_PLLCFGR: PLL configuration register
namespace rcc_pllcfgr {
inline constexpr std::uint32_t kOffset = 0x00C;
inline constexpr std::uint32_t kResetValue = 0x00001000;
inline constexpr Field kPllsrc{0, 2};
inline constexpr Field kPllm{4, 4};
inline constexpr Field kPlln{8, 7};
inline constexpr Field kPllpen{16, 1};
inline constexpr Field kPllp{17, 1};
inline constexpr Field kPllqen{20, 1};
inline constexpr Field kPllq{21, 2};
inline constexpr Field kPllren{24, 1};
inline constexpr Field kPllr{25, 2};
inline constexpr Field kPllpdiv{27, 5};
}
/// RCC.RCC_AHB1RSTR: AHB1 peripheral reset register
namespace rcc_ahb1rstr {
inline constexpr std::uint32_t kOffset = 0x028;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kDma1rst{0, 1};
inline constexpr Field kDma2rst{1, 1};
inline constexpr Field kDmamux1rst{2, 1};
}
/// RCC.RCC_AHB2RSTR: AHB2 peripheral reset register
namespace rcc_ahb2rstr {
inline constexpr std::uint32_t kOffset = 0x02C;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kGpioarst{0, 1};
inline constexpr Field kGpiobrst{1, 1};
inline constexpr Field kGpiocrst{2, 1};
}
/// RCC.RCC_APB1RSTR1: APB1 peripheral reset register 1
namespace rcc_apb1rstr1 {
inline constexpr std::uint32_t kOffset = 0x038;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kTim2rst{0, 1};
inline constexpr Field kTim3rst{1, 1};
inline constexpr Field kUsart2rst{17, 1};
inline constexpr Field kFdcanrst{25, 1};
inline constexpr Field kPwrrst{28, 1};
}
/// RCC.RCC_APB2RSTR: APB2 peripheral reset register
namespace rcc_apb2rstr {
inline constexpr std::uint32_t kOffset = 0x040;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kSyscfgrst{0, 1};
inline constexpr Field kSpi1rst{12, 1};
inline constexpr Field kUsart1rst{14, 1};
}
/// RCC.RCC_AHB1ENR: AHB1 peripheral clock enable register
namespace rcc_ahb1enr {
inline constexpr std::uint32_t kOffset = 0x048;
inline constexpr std::uint32_t kResetValue = 0x00000100;
inline constexpr Field kDma1en{0, 1};
inline constexpr Field kDma2en{1, 1};
inline constexpr Field kDmamux1en{2, 1};
inline constexpr Field kFlashen{8, 1};
}
/// RCC.RCC_AHB2ENR: AHB2 peripheral clock enable register
namespace rcc_ahb2enr {
inline constexpr std::uint32_t kOffset = 0x04C;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kGpioaen{0, 1};
inline constexpr Field kGpioben{1, 1};
inline constexpr Field kGpiocen{2, 1};
}
/// RCC.RCC_APB1ENR1: APB1 peripheral clock enable register 1
namespace rcc_apb1enr1 {
inline constexpr std::uint32_t kOffset = 0x058;
inline constexpr std::uint32_t kResetValue = 0x00000400;
inline constexpr Field kTim2en{0, 1};
inline constexpr Field kTim3en{1, 1};
inline constexpr Field kUsart2en{17, 1};
inline constexpr Field kFdcanen{25, 1};
inline constexpr Field kPwren{28, 1};
}
/// RCC.RCC_APB2ENR: APB2 peripheral clock enable register
namespace rcc_apb2enr {
inline constexpr std::uint32_t kOffset = 0x060;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kSyscfgen{0, 1};
inline constexpr Field kSpi1en{12, 1};
inline constexpr Field kUsart1en{14, 1};
}
/// RCC.RCC_CCIPR: Peripherals independent clock configuration register
namespace rcc_ccipr {
inline constexpr std::uint32_t kOffset = 0x088;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kUsart1sel{0, 2};
inline constexpr Field kUsart2sel{2, 2};
inline constexpr Field kFdcansel{24, 2};
}
/// RCC.RCC_CSR: Control/status register
namespace rcc_csr {
inline constexpr std::uint32_t kOffset = 0x094;
inline constexpr std::uint32_t kResetValue = 0x0C000000;
inline constexpr Field kLsion{0, 1};
inline constexpr Field kLsirdy{1, 1};
inline constexpr Field kRmvf{23, 1};
inline constexpr Field kPinrstf{26, 1};
inline constexpr Field kBorrstf{27, 1};
inline constexpr Field kSftrstf{28, 1};
inline constexpr Field kIwdgrstf{29, 1};
}
}  // namespace rcc

namespace pwr {
inline constexpr std::uint32_t kPwr = 0x40007000;  ///< base address
/// PWR.PWR_CR1: Power control register 1
namespace pwr_cr1 {
inline constexpr std::uint32_t kOffset = 0x000;
inline constexpr std::uint32_t kResetValue = 0x00000200;
inline constexpr Field kVos{9, 2};
inline constexpr Field kLpr{14, 1};
}
/// PWR.PWR_CR3: Power control register 3
namespace pwr_cr3 {
inline constexpr std::uint32_t kOffset = 0x008;
inline constexpr std::uint32_t kResetValue = 0x00008000;
inline constexpr Field kUcpd1Dbdis{14, 1};
}
/// PWR.PWR_SR2: Power status register 2
namespace pwr_sr2 {
inline constexpr std::uint32_t kOffset = 0x014;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kVosf{10, 1};
}
/// PWR.PWR_CR5: Power control register
namespace pwr_cr5 {
inline constexpr std::uint32_t kOffset = 0x080;
inline constexpr std::uint32_t kResetValue = 0x00000100;
inline constexpr Field kR1mode{8, 1};
}
}  // namespace pwr

namespace flash {
inline constexpr std::uint32_t kFlash = 0x40022000;  ///< base address
/// FLASH.FLASH_ACR: Flash access control register
namespace flash_acr {
inline constexpr std::uint32_t kOffset = 0x000;
inline constexpr std::uint32_t kResetValue = 0x00040601;
inline constexpr Field kLatency{0, 4};
inline constexpr Field kPrften{8, 1};
inline constexpr Field kIcen{9, 1};
inline constexpr Field kDcen{10, 1};
inline constexpr Field kIcrst{11, 1};
inline constexpr Field kDcrst{12, 1};
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
}
/// GPIOA.OTYPER: GPIO port output type register
namespace otyper {
inline constexpr std::uint32_t kOffset = 0x004;
inline constexpr std::uint32_t kResetValue = 0x00000000;
}
/// GPIOA.OSPEEDR: GPIO port output speed register
namespace ospeedr {
inline constexpr std::uint32_t kOffset = 0x008;
inline constexpr std::uint32_t kResetValueGpioa = 0x0C000000;
inline constexpr std::uint32_t kResetValueGpiob = 0x000000C0;
inline constexpr std::uint32_t kResetValueGpioc = 0x00000000;
}
/// GPIOA.PUPDR: GPIO port pull-up/pull-down register
namespace pupdr {
inline constexpr std::uint32_t kOffset = 0x00C;
inline constexpr std::uint32_t kResetValueGpioa = 0x64000000;
inline constexpr std::uint32_t kResetValueGpiob = 0x00000100;
inline constexpr std::uint32_t kResetValueGpioc = 0x00000000;
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
/// GPIOA.BSRR: GPIO port bit set/reset register
namespace bsrr {
inline constexpr std::uint32_t kOffset = 0x018;
inline constexpr std::uint32_t kResetValue = 0x00000000;
}
/// GPIOA.AFRL: GPIO alternate function low register
namespace afrl {
inline constexpr std::uint32_t kOffset = 0x020;
inline constexpr std::uint32_t kResetValue = 0x00000000;
}
/// GPIOA.AFRH: GPIO alternate function high register
namespace afrh {
inline constexpr std::uint32_t kOffset = 0x024;
inline constexpr std::uint32_t kResetValue = 0x00000000;
}
/// GPIOA.BRR: GPIO port bit reset register
namespace brr {
inline constexpr std::uint32_t kOffset = 0x028;
inline constexpr std::uint32_t kResetValue = 0x00000000;
}
}  // namespace gpio

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

namespace dma {
inline constexpr std::uint32_t kDma1 = 0x40020000;  ///< base address
inline constexpr std::uint32_t kDma2 = 0x40020400;  ///< base address
/// DMA1.ISR: interrupt status register
namespace isr {
inline constexpr std::uint32_t kOffset = 0x000;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kGif1{0, 1};
inline constexpr Field kTcif1{1, 1};
inline constexpr Field kHtif1{2, 1};
inline constexpr Field kTeif1{3, 1};
}
/// DMA1.IFCR: DMA interrupt flag clear register
namespace ifcr {
inline constexpr std::uint32_t kOffset = 0x004;
inline constexpr std::uint32_t kResetValue = 0x00000000;
}
/// DMA1.CCR#: DMA channel 1 configuration register
namespace ccrx {
inline constexpr std::uint32_t kOffset = 0x008;
inline constexpr std::uint32_t kStride = 0x14, kCount = 8;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kEn{0, 1};
inline constexpr Field kTcie{1, 1};
inline constexpr Field kHtie{2, 1};
inline constexpr Field kTeie{3, 1};
inline constexpr Field kDir{4, 1};
inline constexpr Field kCirc{5, 1};
inline constexpr Field kPinc{6, 1};
inline constexpr Field kMinc{7, 1};
inline constexpr Field kPsize{8, 2};
inline constexpr Field kMsize{10, 2};
inline constexpr Field kPl{12, 2};
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
}
/// USART1.RQR: Request register
namespace rqr {
inline constexpr std::uint32_t kOffset = 0x018;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kRxfrq{3, 1};
inline constexpr Field kTxfrq{4, 1};
}
/// USART1.ISR: Interrupt & status register
namespace isr {
inline constexpr std::uint32_t kOffset = 0x01C;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kPe{0, 1};
inline constexpr Field kFe{1, 1};
inline constexpr Field kNf{2, 1};
inline constexpr Field kOre{3, 1};
inline constexpr Field kIdle{4, 1};
inline constexpr Field kRxne{5, 1};
inline constexpr Field kTc{6, 1};
inline constexpr Field kTxe{7, 1};
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
inline constexpr Field kIdlecf{4, 1};
inline constexpr Field kTccf{6, 1};
}
/// USART1.RDR: Receive data register
namespace rdr {
inline constexpr std::uint32_t kOffset = 0x024;
inline constexpr std::uint32_t kResetValue = 0x00000000;
}
/// USART1.TDR: Transmit data register
namespace tdr {
inline constexpr std::uint32_t kOffset = 0x028;
inline constexpr std::uint32_t kResetValue = 0x00000000;
}
/// USART1.PRESC: USART prescaler register
namespace presc {
inline constexpr std::uint32_t kOffset = 0x02C;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kPrescaler{0, 4};
}
}  // namespace usart

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
inline constexpr Field kLsbfirst{7, 1};
inline constexpr Field kSsi{8, 1};
inline constexpr Field kSsm{9, 1};
inline constexpr Field kRxonly{10, 1};
inline constexpr Field kCrcen{13, 1};
inline constexpr Field kBidimode{15, 1};
}
/// SPI1.CR2: control register 2
namespace cr2 {
inline constexpr std::uint32_t kOffset = 0x004;
inline constexpr std::uint32_t kResetValue = 0x00000700;
inline constexpr Field kRxdmaen{0, 1};
inline constexpr Field kTxdmaen{1, 1};
inline constexpr Field kSsoe{2, 1};
inline constexpr Field kNssp{3, 1};
inline constexpr Field kFrf{4, 1};
inline constexpr Field kErrie{5, 1};
inline constexpr Field kRxneie{6, 1};
inline constexpr Field kTxeie{7, 1};
inline constexpr Field kDs{8, 4};
inline constexpr Field kFrxth{12, 1};
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
}
}  // namespace spi

namespace tim3 {
inline constexpr std::uint32_t kTim3 = 0x40000400;  ///< base address
}  // namespace tim3

namespace tim {
inline constexpr std::uint32_t kTim2 = 0x40000000;  ///< base address
/// TIM2.TIM2_CR1: TIM2 control register 1
namespace tim2_cr1 {
inline constexpr std::uint32_t kOffset = 0x000;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kCen{0, 1};
inline constexpr Field kUifremap{11, 1};
inline constexpr Field kDithen{12, 1};
}
/// TIM2.TIM2_SMCR: TIM2 slave mode control register
namespace tim2_smcr {
inline constexpr std::uint32_t kOffset = 0x008;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kSms{0, 3};
inline constexpr Field kSms1{16, 1};
inline constexpr Field kSmspe{24, 1};
}
/// TIM2.TIM2_CCMR1: TIM2 capture/compare mode register 1 [alternate]
namespace tim2_ccmr1 {
inline constexpr std::uint32_t kOffset = 0x018;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kCc1s{0, 2};
inline constexpr Field kCc2s{8, 2};
}
/// TIM2.TIM2_CNT: TIM2 counter
namespace tim2_cnt {
inline constexpr std::uint32_t kOffset = 0x024;
inline constexpr std::uint32_t kResetValue = 0x00000000;
}
/// TIM2.TIM2_ARR: TIM2 auto-reload register
namespace tim2_arr {
inline constexpr std::uint32_t kOffset = 0x02C;
inline constexpr std::uint32_t kResetValue = 0xFFFFFFFF;
}
}  // namespace tim

namespace iwdg {
inline constexpr std::uint32_t kIwdg = 0x40003000;  ///< base address
/// IWDG.KR: Key register
namespace kr {
inline constexpr std::uint32_t kOffset = 0x000;
inline constexpr std::uint32_t kResetValue = 0x00000000;
}
/// IWDG.PR: Prescaler register
namespace pr {
inline constexpr std::uint32_t kOffset = 0x004;
inline constexpr std::uint32_t kResetValue = 0x00000000;
}
/// IWDG.RLR: Reload register
namespace rlr {
inline constexpr std::uint32_t kOffset = 0x008;
inline constexpr std::uint32_t kResetValue = 0x00000FFF;
}
/// IWDG.SR: Status register
namespace sr {
inline constexpr std::uint32_t kOffset = 0x00C;
inline constexpr std::uint32_t kResetValue = 0x00000000;
}
/// IWDG.WINR: Window register
namespace winr {
inline constexpr std::uint32_t kOffset = 0x010;
inline constexpr std::uint32_t kResetValue = 0x00000FFF;
}
}  // namespace iwdg

namespace fdcan {
inline constexpr std::uint32_t kFdcan1 = 0x40006400;  ///< base address
inline constexpr std::uint32_t kFdcan = 0x4000A400;  ///< base address
/// FDCAN1.FDCAN_CREL: FDCAN core release register
namespace fdcan_crel {
inline constexpr std::uint32_t kOffset = 0x000;
inline constexpr std::uint32_t kResetValue = 0x32141218;
}
/// FDCAN1.FDCAN_ENDN: FDCAN endian register
namespace fdcan_endn {
inline constexpr std::uint32_t kOffset = 0x004;
inline constexpr std::uint32_t kResetValue = 0x87654321;
}
/// FDCAN1.FDCAN_DBTP: FDCAN data bit timing and prescaler register
namespace fdcan_dbtp {
inline constexpr std::uint32_t kOffset = 0x00C;
inline constexpr std::uint32_t kResetValue = 0x00000A33;
}
/// FDCAN1.FDCAN_TEST: FDCAN test register
namespace fdcan_test {
inline constexpr std::uint32_t kOffset = 0x010;
inline constexpr std::uint32_t kResetValue = 0x00000000;
}
/// FDCAN1.FDCAN_RWD: FDCAN RAM watchdog register
namespace fdcan_rwd {
inline constexpr std::uint32_t kOffset = 0x014;
inline constexpr std::uint32_t kResetValue = 0x00000000;
}
/// FDCAN1.FDCAN_CCCR: FDCAN CC control register
namespace fdcan_cccr {
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
/// FDCAN1.FDCAN_NBTP: FDCAN nominal bit timing and prescaler register
namespace fdcan_nbtp {
inline constexpr std::uint32_t kOffset = 0x01C;
inline constexpr std::uint32_t kResetValue = 0x06000A03;
inline constexpr Field kNtseg2{0, 7};
inline constexpr Field kNtseg1{8, 8};
inline constexpr Field kNbrp{16, 9};
inline constexpr Field kNsjw{25, 7};
}
/// FDCAN1.FDCAN_TSCC: FDCAN timestamp counter configuration register
namespace fdcan_tscc {
inline constexpr std::uint32_t kOffset = 0x020;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kTss{0, 2};
inline constexpr Field kTcp{16, 4};
}
/// FDCAN1.FDCAN_TSCV: FDCAN timestamp counter value register
namespace fdcan_tscv {
inline constexpr std::uint32_t kOffset = 0x024;
inline constexpr std::uint32_t kResetValue = 0x00000000;
}
/// FDCAN1.FDCAN_TOCC: FDCAN timeout counter configuration register
namespace fdcan_tocc {
inline constexpr std::uint32_t kOffset = 0x028;
inline constexpr std::uint32_t kResetValue = 0xFFFF0000;
inline constexpr Field kEtoc{0, 1};
}
/// FDCAN1.FDCAN_TOCV: FDCAN timeout counter value register
namespace fdcan_tocv {
inline constexpr std::uint32_t kOffset = 0x02C;
inline constexpr std::uint32_t kResetValue = 0x0000FFFF;
}
/// FDCAN1.FDCAN_ECR: FDCAN error counter register
namespace fdcan_ecr {
inline constexpr std::uint32_t kOffset = 0x040;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kTec{0, 8};
inline constexpr Field kRec{8, 7};
inline constexpr Field kRp{15, 1};
inline constexpr Field kCel{16, 8};
}
/// FDCAN1.FDCAN_PSR: FDCAN protocol status register
namespace fdcan_psr {
inline constexpr std::uint32_t kOffset = 0x044;
inline constexpr std::uint32_t kResetValue = 0x00000707;
inline constexpr Field kLec{0, 3};
inline constexpr Field kAct{3, 2};
inline constexpr Field kEp{5, 1};
inline constexpr Field kEw{6, 1};
inline constexpr Field kBo{7, 1};
inline constexpr Field kDlec{8, 3};
}
/// FDCAN1.FDCAN_TDCR: FDCAN transmitter delay compensation register
namespace fdcan_tdcr {
inline constexpr std::uint32_t kOffset = 0x048;
inline constexpr std::uint32_t kResetValue = 0x00000000;
}
/// FDCAN1.FDCAN_IR: FDCAN interrupt register
namespace fdcan_ir {
inline constexpr std::uint32_t kOffset = 0x050;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kRf0n{0, 1};
inline constexpr Field kRf0f{1, 1};
inline constexpr Field kRf0l{2, 1};
inline constexpr Field kRf1n{3, 1};
inline constexpr Field kRf1f{4, 1};
inline constexpr Field kRf1l{5, 1};
inline constexpr Field kHpm{6, 1};
inline constexpr Field kTc{7, 1};
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
/// FDCAN1.FDCAN_IE: FDCAN interrupt enable register
namespace fdcan_ie {
inline constexpr std::uint32_t kOffset = 0x054;
inline constexpr std::uint32_t kResetValue = 0x00000000;
}
/// FDCAN1.FDCAN_ILS: FDCAN interrupt line select register
namespace fdcan_ils {
inline constexpr std::uint32_t kOffset = 0x058;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kRxfifo0{0, 1};
inline constexpr Field kRxfifo1{1, 1};
inline constexpr Field kSmsg{2, 1};
inline constexpr Field kTferr{3, 1};
inline constexpr Field kMisc{4, 1};
inline constexpr Field kBerr{5, 1};
inline constexpr Field kPerr{6, 1};
}
/// FDCAN1.FDCAN_ILE: FDCAN interrupt line enable register
namespace fdcan_ile {
inline constexpr std::uint32_t kOffset = 0x05C;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kEint0{0, 1};
inline constexpr Field kEint1{1, 1};
}
/// FDCAN1.FDCAN_RXGFC: FDCAN global filter configuration register
namespace fdcan_rxgfc {
inline constexpr std::uint32_t kOffset = 0x080;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kRrfe{0, 1};
inline constexpr Field kRrfs{1, 1};
inline constexpr Field kAnfe{2, 2};
inline constexpr Field kAnfs{4, 2};
inline constexpr Field kF1om{8, 1};
inline constexpr Field kF0om{9, 1};
inline constexpr Field kLss{16, 5};
inline constexpr Field kLse{24, 4};
}
/// FDCAN1.FDCAN_XIDAM: FDCAN extended ID and mask register
namespace fdcan_xidam {
inline constexpr std::uint32_t kOffset = 0x084;
inline constexpr std::uint32_t kResetValue = 0x1FFFFFFF;
}
/// FDCAN1.FDCAN_HPMS: FDCAN high-priority message status register
namespace fdcan_hpms {
inline constexpr std::uint32_t kOffset = 0x088;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kBidx{0, 3};
inline constexpr Field kMsi{6, 2};
inline constexpr Field kFidx{8, 5};
inline constexpr Field kFlst{15, 1};
}
/// FDCAN1.FDCAN_RXF0S: FDCAN Rx FIFO 0 status register
namespace fdcan_rxf0s {
inline constexpr std::uint32_t kOffset = 0x090;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kF0fl{0, 4};
inline constexpr Field kF0gi{8, 2};
inline constexpr Field kF0pi{16, 2};
inline constexpr Field kF0f{24, 1};
inline constexpr Field kRf0l{25, 1};
}
/// FDCAN1.FDCAN_RXF0A: CAN Rx FIFO 0 acknowledge register
namespace fdcan_rxf0a {
inline constexpr std::uint32_t kOffset = 0x094;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kF0ai{0, 3};
}
/// FDCAN1.FDCAN_RXF1S: FDCAN Rx FIFO 1 status register
namespace fdcan_rxf1s {
inline constexpr std::uint32_t kOffset = 0x098;
inline constexpr std::uint32_t kResetValue = 0x00000000;
}
/// FDCAN1.FDCAN_RXF1A: FDCAN Rx FIFO 1 acknowledge register
namespace fdcan_rxf1a {
inline constexpr std::uint32_t kOffset = 0x09C;
inline constexpr std::uint32_t kResetValue = 0x00000000;
}
/// FDCAN1.FDCAN_TXBC: FDCAN Tx buffer configuration register
namespace fdcan_txbc {
inline constexpr std::uint32_t kOffset = 0x0C0;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kTfqm{24, 1};
}
/// FDCAN1.FDCAN_TXFQS: FDCAN Tx FIFO/queue status register
namespace fdcan_txfqs {
inline constexpr std::uint32_t kOffset = 0x0C4;
inline constexpr std::uint32_t kResetValue = 0x00000003;
inline constexpr Field kTffl{0, 3};
inline constexpr Field kTfgi{8, 2};
inline constexpr Field kTfqpi{16, 2};
inline constexpr Field kTfqf{21, 1};
}
/// FDCAN1.FDCAN_TXBRP: FDCAN Tx buffer request pending register
namespace fdcan_txbrp {
inline constexpr std::uint32_t kOffset = 0x0C8;
inline constexpr std::uint32_t kResetValue = 0x00000000;
}
/// FDCAN1.FDCAN_TXBAR: FDCAN Tx buffer add request register
namespace fdcan_txbar {
inline constexpr std::uint32_t kOffset = 0x0CC;
inline constexpr std::uint32_t kResetValue = 0x00000000;
}
/// FDCAN1.FDCAN_TXBCR: FDCAN Tx buffer cancellation request register
namespace fdcan_txbcr {
inline constexpr std::uint32_t kOffset = 0x0D0;
inline constexpr std::uint32_t kResetValue = 0x00000000;
}
/// FDCAN1.FDCAN_TXBTO: FDCAN Tx buffer transmission occurred register
namespace fdcan_txbto {
inline constexpr std::uint32_t kOffset = 0x0D4;
inline constexpr std::uint32_t kResetValue = 0x00000000;
}
/// FDCAN1.FDCAN_TXBCF: FDCAN Tx buffer cancellation finished register
namespace fdcan_txbcf {
inline constexpr std::uint32_t kOffset = 0x0D8;
inline constexpr std::uint32_t kResetValue = 0x00000000;
}
/// FDCAN1.FDCAN_TXBTIE: FDCAN Tx buffer transmission interrupt enable register
namespace fdcan_txbtie {
inline constexpr std::uint32_t kOffset = 0x0DC;
inline constexpr std::uint32_t kResetValue = 0x00000000;
}
/// FDCAN1.FDCAN_TXBCIE: FDCAN Tx buffer cancellation finished interrupt enable register
namespace fdcan_txbcie {
inline constexpr std::uint32_t kOffset = 0x0E0;
inline constexpr std::uint32_t kResetValue = 0x00000000;
}
/// FDCAN1.FDCAN_TXEFS: FDCAN Tx event FIFO status register
namespace fdcan_txefs {
inline constexpr std::uint32_t kOffset = 0x0E4;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kEffl{0, 3};
inline constexpr Field kEfgi{8, 2};
inline constexpr Field kEfpi{16, 2};
inline constexpr Field kEff{24, 1};
inline constexpr Field kTefl{25, 1};
}
/// FDCAN1.FDCAN_TXEFA: FDCAN Tx event FIFO acknowledge register
namespace fdcan_txefa {
inline constexpr std::uint32_t kOffset = 0x0E8;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kEfai{0, 2};
}
/// FDCAN1.FDCAN_CKDIV: FDCAN CFG clock divider register
namespace fdcan_ckdiv {
inline constexpr std::uint32_t kOffset = 0x100;
inline constexpr std::uint32_t kResetValue = 0x00000000;
inline constexpr Field kPdiv{0, 4};
}
}  // namespace fdcan

}  // namespace tetap::hal::stm32g474_model
