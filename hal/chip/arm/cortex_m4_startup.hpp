// SPDX-License-Identifier: Apache-2.0
// Vectors, reset, interrupts and faults of a board with a Cortex-M4F. ARM DDI 0403E.e B1.5 (exceptions), B3.2 (system
// control). One file of an image includes this, its startup.cpp, where tetap::hal::started names the board's namespace.
#pragma once

#include "hal/chip/arm/cortex_m4.hpp"
#include "hal/chip/arm/nvic.hpp"
#include "hal/chip/arm/stored_fault.hpp"
#include "hal/chip/support/image.hpp"

#include <array>
#include <cstddef>
#include <cstdint>

// NOLINTBEGIN(misc-definitions-in-headers): one file of an image includes this

// ISO C++ does not let a program call main by that name.
int image_main() asm("main");

namespace tetap::hal {
[[gnu::section(".noinit")]] StoredFault stored_fault;
}

extern "C" {

extern const std::uint32_t __vectors[];      // NOLINT(bugprone-reserved-identifier): link.ld makes this name
extern const std::uint32_t __stack_guard[];  // NOLINT(bugprone-reserved-identifier): the same

[[noreturn]] void tetap_reset();
[[noreturn]] void tetap_start();
void tetap_interrupt();
void tetap_exception();
[[noreturn]] void tetap_fault(const std::uint32_t* frame, std::uint32_t exception);

// A boot loader may have left any stack pointer and interrupts that are on.
[[gnu::naked, gnu::used]] void tetap_reset() {
  asm volatile(
      "cpsid i\n"
      "ldr r0, =__stack_top\n"
      "mov sp, r0\n"
      "mov r1, #0\n"
      "msr control, r1\n"
      "isb\n"
      "ldr r1, =__stack_bottom\n"
      "ldr r2, =0xA5A5A5A5\n"  // kStackPaint
      "1: str r2, [r1], #4\n"
      "cmp r1, r0\n"
      "blo 1b\n"
      "b tetap_start\n"
      ".ltorg\n");
}

// The stacked frame holds LR at [5] and the program counter at [6]. A stack that has run over must not stop the report.
[[gnu::naked, gnu::used]] void tetap_exception() {
  asm volatile(
      "mov r0, sp\n"
      "mrs r1, ipsr\n"
      "ldr r2, =__stack_top\n"
      "mov sp, r2\n"
      "b tetap_fault\n"
      ".ltorg\n");
}

void tetap_start() {
  constexpr auto kSystem = tetap::hal::started::Board::kSystem;
  kSystem.write(tetap::hal::cortex_m4::scb::kVtor,
                static_cast<std::uint32_t>(reinterpret_cast<std::uintptr_t>(__vectors)));
  tetap::hal::enable_fpu(kSystem);
  tetap::hal::load_sections();
  tetap::hal::guard(kSystem, static_cast<std::uint32_t>(reinterpret_cast<std::uintptr_t>(__stack_guard)));
  // Sources that a boot loader left on are off before interrupts are let in.
  tetap::hal::Nvic<tetap::hal::Mmio>{kSystem}.clear();
  asm volatile("cpsie i" ::: "memory");
  image_main();
  tetap::hal::Nvic<tetap::hal::Mmio>{kSystem}.reset();
}

void tetap_interrupt() {
  std::uint32_t exception = 0;
  asm volatile("mrs %0, ipsr" : "=r"(exception));
  if (auto* const board = tetap::hal::started::Board::running) board->on_interrupt(exception);
}

void tetap_fault(const std::uint32_t* frame, std::uint32_t exception) {
  constexpr auto kSystem = tetap::hal::started::Board::kSystem;
  namespace scb = tetap::hal::cortex_m4::scb;
  const bool on_stack = frame >= __stack_bottom && frame + 8 <= __stack_top;
  const tetap::hal::FaultState state{
      .exception = exception,
      .stack_left = !on_stack,
      .guard = static_cast<std::uint32_t>(reinterpret_cast<std::uintptr_t>(__stack_guard)),
      .stacked_lr = on_stack ? frame[5] : 0,
      .stacked_pc = on_stack ? frame[6] : 0,
      .cfsr = kSystem.read(scb::kCfsr),
      .mmfar = kSystem.read(scb::kMmfar),
      .bfar = kSystem.read(scb::kBfar)};
  tetap::hal::stored_fault.store(tetap::hal::describe(state));
  tetap::hal::Nvic<tetap::hal::Mmio>{kSystem}.reset();
}

using Handler = void (*)();
inline constexpr std::size_t kExceptions = 16;
struct Vectors {
  const void* stack_top;
  std::array<Handler, kExceptions - 1 + tetap::hal::started::Board::kLastInterrupt + 1> handlers;
};

consteval Vectors make_vectors() {
  Vectors table{.stack_top = __stack_top, .handlers = {}};
  for (Handler& handler : table.handlers) handler = tetap_exception;
  constexpr std::size_t kSysTick = 15;
  table.handlers[0] = tetap_reset;
  table.handlers[kSysTick - 1] = tetap_interrupt;
  for (const int interrupt : tetap::hal::started::Board::kInterrupts) {
    table.handlers[kExceptions - 1 + static_cast<std::size_t>(interrupt)] = tetap_interrupt;
  }
  return table;
}
[[gnu::used, gnu::section(".vectors")]] constinit const Vectors tetap_vectors = make_vectors();

}  // extern "C"

// NOLINTEND(misc-definitions-in-headers)
