// SPDX-License-Identifier: Apache-2.0
// Vectors, reset and exceptions of the Cortex-R5F. ARM DDI 0460 (Cortex-R5 TRM) chapters 2 and 4, ARM DDI 0406 section
// B1.
#include "hal/board/zynqmp_r5/board.hpp"
#include "hal/chip/support/image.hpp"
#include "hal/chip/support/text.hpp"

// ISO C++ does not let a program call main by that name.
int image_main() asm("main");

extern "C" {

[[noreturn]] void tetap_start();
[[noreturn]] void tetap_exception(std::uint32_t kind, std::uint32_t address);

[[gnu::naked, gnu::used, gnu::target("arm"), gnu::section(".vectors")]] void _start() {
  asm volatile(
      "b tetap_reset\n"
      "b tetap_undefined\n"
      "b tetap_svc\n"
      "b tetap_prefetch_abort\n"
      "b tetap_data_abort\n"
      "b tetap_reserved\n"
      "b tetap_irq\n"
      "b tetap_fiq\n");
}

[[gnu::naked, gnu::used, gnu::target("arm")]] void tetap_reset() {
  asm volatile(
      "cpsid if\n"
      "cps #0x1F\n"  // system mode for good: there are no interrupts and no privileges to lose
      "ldr sp, =__stack_top\n"
      "mrc p15, 0, r0, c1, c0, 0\n"  // SCTLR.V = 0: vectors at 0, where the tightly coupled memory is
      "bic r0, r0, #(1 << 13)\n"
      "mcr p15, 0, r0, c1, c0, 0\n"
      "mrc p15, 0, r0, c1, c0, 2\n"  // CPACR: full access to the floating-point unit
      "orr r0, r0, #(0xF << 20)\n"
      "mcr p15, 0, r0, c1, c0, 2\n"
      "isb\n"
      "mov r0, #(1 << 30)\n"
      "vmsr fpexc, r0\n"
      "mov r0, #0\n"  // FPSCR: round to nearest, subnormals kept (FZ = 0), NaN payloads kept (DN = 0), as everywhere
                      // else
      "vmsr fpscr, r0\n"
      "ldr r0, =__stack_bottom\n"
      "ldr r1, =__stack_top\n"
      "ldr r2, =0xA5A5A5A5\n"  // kStackPaint
      "1: cmp r0, r1\n"
      "strlo r2, [r0], #4\n"
      "blo 1b\n"
      "b tetap_start\n"
      ".ltorg\n");
}

// Each mode has its own stack pointer; one small stack is enough, because nothing returns from here.
#define TETAP_EXCEPTION(name, kind, offset)                   \
  [[gnu::naked, gnu::used, gnu::target("arm")]] void name() { \
    asm volatile(                                             \
        "ldr sp, =__exception_stack_top\n"                    \
        "mov r0, #" #kind                                     \
        "\n"                                                  \
        "sub r1, lr, #" #offset                               \
        "\n"                                                  \
        "b tetap_exception\n"                                 \
        ".ltorg\n");                                          \
  }
TETAP_EXCEPTION(tetap_undefined, 1, 4)
TETAP_EXCEPTION(tetap_svc, 2, 4)
TETAP_EXCEPTION(tetap_prefetch_abort, 3, 4)
TETAP_EXCEPTION(tetap_data_abort, 4, 8)
TETAP_EXCEPTION(tetap_reserved, 5, 0)
TETAP_EXCEPTION(tetap_irq, 6, 4)
TETAP_EXCEPTION(tetap_fiq, 7, 4)
#undef TETAP_EXCEPTION

void tetap_start() {
  tetap::hal::load_sections();
  image_main();
  for (;;) asm volatile("wfi");
}

void tetap_exception(std::uint32_t kind, std::uint32_t address) {
  constexpr const char* kNames[] = {
      "reset",     "undefined instruction", "supervisor call", "prefetch abort", "data abort", "reserved",
      "interrupt", "fast interrupt"};
  std::uint32_t fault_address = 0;
  std::uint32_t fault_status = 0;
  asm volatile("mrc p15, 0, %0, c6, c0, 0" : "=r"(fault_address));  // DFAR
  asm volatile("mrc p15, 0, %0, c5, c0, 0" : "=r"(fault_status));   // DFSR
  tetap::hal::Text<> line;
  line.add("tetap: exception: ").add(kNames[kind & 7U]).add(" at ").hex(address);
  if (kind == 4) line.add(", address ").hex(fault_address).add(", status ").hex(fault_status);
  tetap::hal::zynqmp_r5::Uart{tetap::hal::zynqmp_r5::kUart0}.print(line.add('\n').c_str());
  for (;;) asm volatile("wfi");
}

}  // extern "C"
