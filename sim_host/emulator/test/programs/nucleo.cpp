// SPDX-License-Identifier: Apache-2.0
// For the emulated Nucleo-G474RE: clock to 160 MHz, a line on the console, frames by FDCAN from its interrupt, code in
// the CCM SRAM. Each choice but 0 makes one mistake.
#include "hal/chip/arm/cortex_m4.hpp"
#include "hal/chip/stm32/registers_stm32g474.hpp"
#include "hal/chip/support/mmio.hpp"

#include <cstdint>

namespace reg = tetap::hal::stm32g474;
namespace m4 = tetap::hal::cortex_m4;
namespace can = reg::fdcan;
using tetap::hal::Mmio;

namespace {

enum Mistake : std::uint32_t { kNone, kFlagNotCleared, kFifoNotAcknowledged, kWaitStates, kEraseOtherBank, kReadPage };

struct Shared {
  std::uint32_t choice;
  std::uint32_t results[15];
};
volatile Shared& shared() { return *reinterpret_cast<volatile Shared*>(0x2001'6000); }
bool is(Mistake mistake) { return shared().choice == mistake; }

constexpr Mmio kRcc{reg::rcc::kRcc}, kPwr{reg::pwr::kPwr}, kFlash{reg::flash::kFlash}, kGpioA{reg::gpio::kGpioa},
    kUsart2{reg::usart::kUsart2}, kCan{can::kFdcan1}, kRam{can::kFdcan}, kScs{m4::kSystemControlSpace};

void set(Mmio block, std::uint32_t offset, std::uint32_t mask) { block.write(offset, block.read(offset) | mask); }

void wait(Mmio block, std::uint32_t offset, std::uint32_t mask, std::uint32_t value) {
  for (int i = 0; i < 200'000 && (block.read(offset) & mask) != value; ++i) continue;
}

void alternate(std::uint32_t pin, std::uint32_t function) {
  const std::uint32_t afr = pin < 8 ? reg::gpio::afrl::kOffset : reg::gpio::afrh::kOffset, shift = 4 * (pin % 8);
  kGpioA.write(afr, (kGpioA.read(afr) & ~(0xFU << shift)) | function << shift);
  kGpioA.write(reg::gpio::moder::kOffset, (kGpioA.read(reg::gpio::moder::kOffset) & ~(3U << 2 * pin)) | 2U << 2 * pin);
}

void start_clock() {
  namespace r = reg::rcc;
  set(kRcc, r::apb1enr1::kOffset,
      r::apb1enr1::kPwren.mask() | r::apb1enr1::kUsart2en.mask() | r::apb1enr1::kFdcanen.mask());
  set(kRcc, r::ahb2enr::kOffset, r::ahb2enr::kGpioaen.mask());
  kPwr.write(reg::pwr::cr5::kOffset, 0);
  kFlash.write(reg::flash::acr::kOffset, 0x0004'0600 | (is(kWaitStates) ? 3U : 4U));
  set(kRcc, r::cr::kOffset, r::cr::kHseon.mask());
  wait(kRcc, r::cr::kOffset, r::cr::kHserdy.mask(), r::cr::kHserdy.mask());
  kRcc.write(r::pllcfgr::kOffset,
             r::pllcfgr::kPllsrc(3) | r::pllcfgr::kPllm(5) | r::pllcfgr::kPlln(80) | r::pllcfgr::kPllren(1));
  set(kRcc, r::cr::kOffset, r::cr::kPllon.mask());
  wait(kRcc, r::cr::kOffset, r::cr::kPllrdy.mask(), r::cr::kPllrdy.mask());
  kRcc.write(r::cfgr::kOffset, r::cfgr::kHpre(8) | r::cfgr::kSw(3));
  for (int i = 0; i < 100; ++i) asm volatile("nop");
  kRcc.write(r::cfgr::kOffset, r::cfgr::kSw(3));
  kRcc.write(r::ccipr::kOffset, r::ccipr::kFdcansel(2));
}

void print(const char* text) {
  alternate(2, 7);
  kUsart2.write(reg::usart::brr::kOffset, 1389);
  kUsart2.write(reg::usart::cr1::kOffset, reg::usart::cr1::kUe.mask() | reg::usart::cr1::kTe.mask());
  for (; *text != '\0'; ++text) {
    wait(kUsart2, reg::usart::isr::kOffset, reg::usart::isr::kTxe.mask(), reg::usart::isr::kTxe.mask());
    kUsart2.write(reg::usart::tdr::kOffset, static_cast<std::uint8_t>(*text));
  }
}

void start_can() {
  namespace cccr = can::cccr;
  alternate(11, 9);
  alternate(12, 9);
  kCan.write(cccr::kOffset, cccr::kInit(1) | cccr::kCce(1));
  kCan.write(can::nbtp::kOffset,
             can::nbtp::kNbrp(19) | can::nbtp::kNtseg1(12) | can::nbtp::kNtseg2(1) | can::nbtp::kNsjw(1));
  kCan.write(can::ie::kOffset, can::ir::kRf0n.mask());
  kCan.write(can::ile::kOffset, can::ile::kEint0(1));
  kCan.write(cccr::kOffset, 0);
  wait(kCan, cccr::kOffset, cccr::kInit.mask(), 0);
  kScs.write(m4::nvic::kIser, 1U << reg::interrupt::kFdcan1It0);
}

/// Sends the element that was received back with its identifier raised by one.
void echo(std::uint32_t index) {
  const std::uint32_t from = 0x0B0 + 72 * index;
  const std::uint32_t buffer = can::txfqs::kTfqpi.of(kCan.read(can::txfqs::kOffset)), to = 0x278 + 72 * buffer;
  kRam.write(to, kRam.read(from) + (1U << 18));
  kRam.write(to + 4, kRam.read(from + 4) & 0x000F'0000);
  for (std::uint32_t i = 8; i < 16; i += 4) kRam.write(to + i, kRam.read(from + i));
  kCan.write(can::txbar::kOffset, 1U << buffer);
}

[[gnu::section(".ccm"), gnu::noinline]] std::uint32_t from_ccm(std::uint32_t value) { return 3 * value + 1; }

/// Page 0 of bank 2 from code in bank 1: rounds of the loop while BSY = 1.
void erase_other_bank() {
  set(kRcc, reg::rcc::ahb1enr::kOffset, 0x100);
  kFlash.write(0x08, 0x4567'0123);
  kFlash.write(0x08, 0xCDEF'89AB);
  kFlash.write(0x14, 0x1'0802);
  while ((kFlash.read(0x10) & 0x1'0000) != 0) shared().results[3] = shared().results[3] + 1;
  shared().results[4] = 1;
}

/// Sum of page 0 of bank 2, whose double words may be damaged.
void read_page() {
  for (std::uint32_t at = 0; at < 2048; at += 4)
    shared().results[4] = shared().results[4] + *reinterpret_cast<const volatile std::uint32_t*>(0x0804'0000 + at);
  shared().results[3] = kFlash.read(0x18);
}

extern "C" std::uint32_t __ccm_begin[], __ccm_end[], __ccm_load[];

}  // namespace

extern "C" {

[[gnu::used]] void on_can() {
  shared().results[1] = shared().results[1] + 1;
  if (!is(kFlagNotCleared)) kCan.write(can::ir::kOffset, can::ir::kRf0n.mask());
  for (;;) {
    const std::uint32_t status = kCan.read(can::rxf0s::kOffset);
    if (can::rxf0s::kF0fl.of(status) == 0) return;
    const std::uint32_t index = can::rxf0s::kF0gi.of(status);
    echo(index);
    kCan.write(can::rxf0a::kOffset, is(kFifoNotAcknowledged) ? (index + 1) % 3 : index);
    if (is(kFifoNotAcknowledged)) return;
  }
}

[[gnu::used, noreturn]] void program_main() {
  for (std::uint32_t* to = __ccm_begin; to < __ccm_end; ++to) *to = __ccm_load[to - __ccm_begin];
  start_clock();
  shared().results[0] = from_ccm(from_ccm(13));
  if (is(kEraseOtherBank)) erase_other_bank();
  if (is(kReadPage)) read_page();
  print("hello from 160 MHz\n");
  start_can();
  for (;;) asm volatile("wfi");
}

[[gnu::naked, gnu::used, noreturn]] void reset() { asm volatile("b program_main\n"); }
[[gnu::used]] void stray() {
  std::uint32_t number = 0;
  asm volatile("mrs %0, ipsr" : "=r"(number));
  shared().results[2] = number;
  for (;;) continue;
}
}

extern "C" const std::uint32_t __stack_top;

struct Vectors {
  const void* stack;
  void (*handlers[37])();
};
#define STRAY5 stray, stray, stray, stray, stray
// Reset, 14 exceptions of the core, interrupts 0 to 20, FDCAN1_IT0.
[[gnu::used, gnu::section(".vectors")]] const Vectors vectors{
    &__stack_top, {reset, STRAY5, STRAY5, STRAY5, STRAY5, STRAY5, STRAY5, STRAY5, on_can}};
#undef STRAY5
