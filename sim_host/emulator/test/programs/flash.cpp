// SPDX-License-Identifier: Apache-2.0
// Erases and programs the flash that it runs from, and from a few instructions in the SRAM.
#include "choices.hpp"
#include "program.hpp"

using namespace program;
using namespace tetap::board;

namespace {

constexpr Mmio kController{0x4002'3C00};
constexpr std::uint32_t kKeyr = 0x04, kSr = 0x0C, kCr = 0x10, kErase = 0x1'0200 | 2 | 5 << 3, kProgram = 0x201;
constexpr std::uint32_t kSector5 = 0x0802'0000, kCode = 0x2001'0000;

volatile std::uint32_t& flash_word(std::uint32_t at) {
  return *reinterpret_cast<volatile std::uint32_t*>(kSector5 + at);
}

/// r0: FLASH_CR, r1: its value, r2: a counter, r3: a word of flash. Counts while BSY = 1.
[[gnu::naked, gnu::used, gnu::noinline]] void poll() {
  asm volatile(
      "str r1, [r0]\n"
      "subs r0, #4\n"
      "1: ldr r1, [r2]\n"
      "adds r1, #1\n"
      "str r1, [r2]\n"
      "ldr r1, [r0]\n"
      "lsls r1, r1, #15\n"
      "bmi 1b\n"
      "bx lr\n");
}
/// Reads the word while the flash is busy, then FLASH_SR into the counter.
[[gnu::naked, gnu::used, gnu::noinline]] void peek() {
  asm volatile(
      "str r1, [r0]\n"
      "b 1f\n"
      "1: ldr r3, [r3]\n"
      "subs r0, #4\n"
      "ldr r0, [r0]\n"
      "str r0, [r2]\n"
      "mov r0, r3\n"
      "bx lr\n");
}
/// Goes back into the busy flash at once.
[[gnu::naked, gnu::used, gnu::noinline]] void go_back() {
  asm volatile(
      "str r1, [r0]\n"
      "b 1f\n"
      "1: bx lr\n");
}

std::uint32_t from_ram(void (*code)(), std::uint32_t control) {
  const auto from = reinterpret_cast<std::uintptr_t>(code) & ~std::uintptr_t{1};
  for (std::uint32_t at = 0; at < 32; at += 2)
    *reinterpret_cast<volatile std::uint16_t*>(kCode + at) =
        *reinterpret_cast<const volatile std::uint16_t*>(from + at);
  using Code = std::uint32_t (*)(std::uint32_t, std::uint32_t, volatile std::uint32_t*, std::uint32_t);
  return reinterpret_cast<Code>(kCode | 1)(0x4002'3C10, control, &result(1), kSector5);
}

}  // namespace

void on_exception(std::uint32_t number, std::uint32_t*) {
  result(60) = number;
  stop();
}

void program_main() {
  result(0) = 1;
  if (shared().choice == kLockedStore) {
    flash_word(0) = 0;
    result(1) = kController.read(kSr);
    stop();
  }
  kController.write(kKeyr, 0x4567'0123);
  kController.write(kKeyr, 0xCDEF'89AB);
  switch (shared().choice) {
    case kEraseFromFlash:
      kController.write(kCr, kErase);
      break;
    case kPollFromRam:
      from_ram(poll, kErase);
      break;
    case kReadFromRam:
      result(3) = from_ram(peek, kErase);
      break;
    case kReturnToFlash:
      from_ram(go_back, kErase);
      break;
    default:
      kController.write(kCr, kProgram);
      flash_word(0) = 0x1111'1111;
      flash_word(4) = 0x2222'2222;
      asm volatile("strd %0, %1, [%2]" : : "r"(0x3333'3333), "r"(0x4444'4444), "r"(kSector5 + 8) : "memory");
      while ((kController.read(kSr) & 0x1'0000) != 0) continue;
      flash_word(0) = 0x0101'0101;
      result(3) = flash_word(0);
      kController.write(kCr, 0);
      flash_word(0) = 0;
      result(5) = kController.read(kSr);
      result(4) = flash_word(0);
      break;
  }
  result(2) = kController.read(kSr) | 1;
  stop();
}
