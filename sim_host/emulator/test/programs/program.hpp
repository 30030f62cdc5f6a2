// SPDX-License-Identifier: Apache-2.0
// Start, vectors and small helpers of the programs that the emulated board executes in tests. The test writes a choice,
// the program its results, into words of the SRAM that no reset touches.
#pragma once

#include "hal/chip/arm/cortex_m4.hpp"
#include "hal/chip/stm32/registers_stm32f412.hpp"
#include "hal/chip/support/mmio.hpp"

#include <cstdint>

namespace program {

namespace reg = tetap::hal::stm32f412;
namespace m4 = tetap::hal::cortex_m4;
using tetap::hal::Mmio;

inline constexpr std::uint32_t kShared = 0x2002'0000;
struct Shared {
  std::uint32_t choice;
  std::uint32_t results[63];
};
inline volatile Shared& shared() { return *reinterpret_cast<volatile Shared*>(kShared); }
inline volatile std::uint32_t& result(int i) { return shared().results[i]; }

inline constexpr Mmio kRcc{reg::rcc::kRcc}, kPwr{reg::pwr::kPwr}, kFlash{reg::flash::kFlash}, kGpioA{reg::gpio::kGpioa},
    kGpioB{reg::gpio::kGpiob}, kUsart2{reg::usart::kUsart2}, kScs{m4::kSystemControlSpace};

inline void set(Mmio block, std::uint32_t offset, std::uint32_t mask) {
  block.write(offset, block.read(offset) | mask);
}

/// A pin becomes an alternate function.
inline void alternate(Mmio port, std::uint32_t pin, std::uint32_t function) {
  const std::uint32_t afr = pin < 8 ? reg::gpio::afrl::kOffset : reg::gpio::afrh::kOffset, shift = 4 * (pin % 8);
  port.write(afr, (port.read(afr) & ~(0xFU << shift)) | function << shift);
  port.write(reg::gpio::moder::kOffset, (port.read(reg::gpio::moder::kOffset) & ~(3U << 2 * pin)) | 2U << 2 * pin);
}
inline void output(Mmio port, std::uint32_t pin) {
  port.write(reg::gpio::moder::kOffset, (port.read(reg::gpio::moder::kOffset) & ~(3U << 2 * pin)) | 1U << 2 * pin);
}

/// Waits at most `limit` looks for a bit.
inline bool wait(Mmio block, std::uint32_t offset, std::uint32_t mask, int limit = 200'000) {
  for (int i = 0; i < limit; ++i) {
    if ((block.read(offset) & mask) != 0) return true;
  }
  return false;
}

inline void print(const char* text) {
  for (; *text != '\0'; ++text) {
    if (!wait(kUsart2, reg::usart::sr::kOffset, reg::usart::sr::kTxe.mask())) return;
    kUsart2.write(reg::usart::dr::kOffset, static_cast<std::uint8_t>(*text));
  }
}

[[noreturn]] inline void stop() {
  for (;;) asm volatile("wfi");
}

}  // namespace program

extern "C" {

/// Every exception but reset; `number` as in IPSR, `frame` the stacked registers of thread mode.
void on_exception(std::uint32_t number, std::uint32_t* frame);
[[noreturn]] void program_main();

[[gnu::naked, gnu::used]] void exception_stub() {
  asm volatile(
      "mrs r0, ipsr\n"
      "mov r1, sp\n"
      "b on_exception\n");
}

[[gnu::naked, gnu::used, noreturn]] void reset() { asm volatile("b program_main\n"); }
}

extern "C" const std::uint32_t __stack_top;

struct Vectors {
  const void* stack;
  void (*reset)();
  void (*others[111])();
};
#define STUB8                                                                                                     \
  exception_stub, exception_stub, exception_stub, exception_stub, exception_stub, exception_stub, exception_stub, \
      exception_stub
[[gnu::used, gnu::section(".vectors")]] const Vectors vectors{
    &__stack_top, reset, {STUB8,          STUB8,          STUB8,          STUB8,          STUB8,
                          STUB8,          STUB8,          STUB8,          STUB8,          STUB8,
                          STUB8,          STUB8,          STUB8,          exception_stub, exception_stub,
                          exception_stub, exception_stub, exception_stub, exception_stub, exception_stub}};
#undef STUB8
