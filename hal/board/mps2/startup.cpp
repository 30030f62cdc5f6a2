// SPDX-License-Identifier: Apache-2.0
// Vectors, reset and faults of the Cortex-M7 and Cortex-M4F. ARM DDI 0403 (ARMv7-M) sections B1.5 and B3.2.
#include "hal/board/mps2/board.hpp"

// ISO C++ does not let a program call main by that name.
int image_main() asm("main");

extern "C" {

[[noreturn]] void tetap_reset();
[[noreturn]] void tetap_start();
[[noreturn]] void tetap_fault(const std::uint32_t* frame, std::uint32_t exception);

// The exception number picks the name, so every entry but the first two is the same. The stacked frame holds the
// program counter at [6].
[[gnu::naked, gnu::used]] void tetap_vector() {
  asm volatile(
      "mov r0, sp\n"
      "mrs r1, ipsr\n"
      "ldr r2, =__stack_top\n"
      "mov sp, r2\n"  // an overflown stack must not stop the report
      "b tetap_fault\n"
      ".ltorg\n");
}

[[gnu::naked, gnu::used]] void tetap_reset() {
  asm volatile(
      "ldr r0, =0xE000ED88\n"  // CPACR: full access to the floating-point unit
      "ldr r1, [r0]\n"
      "orr r1, r1, #(0xF << 20)\n"
      "str r1, [r0]\n"
      "dsb\n"
      "isb\n"
      "mov r0, #0\n"  // FPSCR: round to nearest, subnormals kept (FZ = 0), NaN payloads kept (DN = 0), as everywhere
                      // else
      "vmsr fpscr, r0\n"
      "ldr r0, =__stack_bottom\n"
      "ldr r1, =__stack_top\n"
      "ldr r2, =0xA5A5A5A5\n"  // kStackPaint
      "1: str r2, [r0], #4\n"
      "cmp r0, r1\n"
      "blo 1b\n"
      "b tetap_start\n"
      ".ltorg\n");
}

struct Vectors {
  const void* stack_top;
  void (*reset)();
  void (*others[14])();
};
[[gnu::used, gnu::section(".vectors")]] constinit const Vectors tetap_vectors{
    .stack_top = __stack_top,
    .reset = tetap_reset,
    .others = {tetap_vector, tetap_vector, tetap_vector, tetap_vector, tetap_vector, tetap_vector, tetap_vector,
               tetap_vector, tetap_vector, tetap_vector, tetap_vector, tetap_vector, tetap_vector, tetap_vector}};

void tetap_start() {
  tetap::hal::load_sections();
  tetap::hal::mps2::semihosting::exit(image_main());
}

void tetap_fault(const std::uint32_t* frame, std::uint32_t exception) {
  constexpr const char* kNames[] = {"none", "reset", "NMI", "HardFault", "MemManage", "BusFault", "UsageFault"};
  constexpr tetap::hal::Mmio kSystemControl{0xE000'ED00};
  constexpr std::uint32_t kCfsr = 0x28, kHfsr = 0x2C, kBfar = 0x38;
  tetap::hal::Text<> line;
  line.add("tetap: exception: ").add(exception < 7 ? kNames[exception] : "interrupt");
  // A stack pointer outside the RAM has no frame that could be read.
  if (frame >= __stack_bottom && frame + 8 <= __stack_top) line.add(" at ").hex(frame[6]);
  line.add(", hfsr ").hex(kSystemControl.read(kHfsr)).add(" cfsr ").hex(kSystemControl.read(kCfsr));
  line.add(" bfar ").hex(kSystemControl.read(kBfar)).add('\n');
  tetap::hal::mps2::Uart{}.print(line.c_str());
  tetap::hal::mps2::semihosting::exit(120);
}

}  // extern "C"
