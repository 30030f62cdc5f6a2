// SPDX-License-Identifier: Apache-2.0
// Exceptions, masks, sleep, floating point and faults of the core, one choice each.
#include "choices.hpp"
#include "program.hpp"

using namespace program;
using namespace tetap::board;

namespace {

void enable_fpu() {
  kScs.write(m4::scb::kCpacr, m4::scb::kCp10(3) | m4::scb::kCp11(3));
  asm volatile("dsb\nisb");
}

void enable_interrupt(std::uint32_t number, std::uint32_t priority) {
  volatile auto* priorities = reinterpret_cast<volatile std::uint8_t*>(m4::kSystemControlSpace + m4::nvic::kIpr);
  priorities[number] = static_cast<std::uint8_t>(priority << 4);
  kScs.write(m4::nvic::kIser + 4 * (number / 32), 1U << number % 32);
}
void pend(std::uint32_t number) { kScs.write(m4::nvic::kIspr + 4 * (number / 32), 1U << number % 32); }

void start_systick(std::uint32_t reload) {
  kScs.write(m4::systick::kRvr, reload);
  kScs.write(m4::systick::kCvr, 0);
  kScs.write(m4::systick::kCsr, 7);
}

void mark(std::uint32_t value) {
  const std::uint32_t at = result(0);
  result(1 + static_cast<int>(at)) = value;
  result(0) = at + 1;
}

void store_float(int at, float value) {
  union {
    float value;
    std::uint32_t bits;
  } both{value};
  result(at) = both.bits;
}

volatile float handler_sum, thread_sum;

[[noreturn]] void float_in_handler() {
  handler_sum = 1.0F;
  float a = 1.0F, b = 0.5F;
  start_systick(999);
  for (int i = 0; i < 20'000; ++i) {
    a = a * 1.0001F + b;
    b = b * 0.9999F - a * 0.25F;
  }
  kScs.write(m4::systick::kCsr, 0);
  store_float(0, a);
  store_float(1, b);
  store_float(2, handler_sum);
  stop();
}

void masks() {
  enable_interrupt(5, 4);
  asm volatile("cpsid i");
  pend(5);
  for (int i = 0; i < 10; ++i) asm volatile("nop");
  mark(100);
  asm volatile("cpsie i\nisb");
  mark(101);
  asm volatile("msr basepri, %0" ::"r"(0x40));
  pend(5);
  for (int i = 0; i < 10; ++i) asm volatile("nop");
  mark(102);
  asm volatile("msr basepri, %0\nisb" ::"r"(0));
  mark(103);
}

// 10 is the most urgent. 12 pends 10 and 11: 10 pre-empts, 11 has the priority of 12 and follows it.
void priorities() {
  enable_interrupt(10, 1);
  enable_interrupt(11, 5);
  enable_interrupt(12, 5);
  pend(12);
  asm volatile("isb");
  mark(200);
}

void sleep() {
  start_systick(15'999);  // 1 ms of 16 MHz
  for (int i = 0; i < 10; ++i) asm volatile("wfi");
  kScs.write(m4::systick::kCsr, 0);
  mark(300);
}

int deeper(int depth) {
  volatile std::uint32_t room[16];
  for (auto& one : room) one = static_cast<std::uint32_t>(depth);
  return depth > 1'000'000 ? 0 : deeper(depth + 1) + static_cast<int>(room[3]);
}

void stack_guard() {
  kScs.write(m4::mpu::kRbar, 0x2001'F000 | m4::mpu::kValid.mask());
  kScs.write(m4::mpu::kRasr, m4::mpu::kRegionEnable(1) | m4::mpu::kSize(7) | m4::mpu::kXn(1));  // 256 bytes, no access
  kScs.write(m4::mpu::kCtrl, m4::mpu::kEnable(1) | m4::mpu::kPrivdefena(1));
  kScs.write(m4::scb::kShcsr, m4::scb::kMemfaultena.mask());
  asm volatile("dsb\nisb");
  result(10) = *reinterpret_cast<volatile std::uint32_t*>(0x2001'F100);  // beside the guard: allowed
  result(11) = static_cast<std::uint32_t>(deeper(0));
}

void unaligned(const char* what) {
  const std::uint32_t address = 0x2000'0102;
  if (what[0] == 'd') asm volatile("ldrd r2, r3, [%0]" ::"r"(address) : "r2", "r3");
  if (what[0] == 'f') asm volatile("vldr s0, [%0]" ::"r"(address) : "s0");
  if (what[0] == 'w') asm volatile("ldr r2, [%0]" ::"r"(address) : "r2");
}

void cycles() {
  constexpr Mmio kDwt{m4::kDwt};
  kScs.write(m4::scb::kDemcr, m4::scb::kTrcena.mask());
  kDwt.write(m4::dwt::kCyccnt, 0);
  kDwt.write(m4::dwt::kCtrl, 1);
  const std::uint32_t begin = kDwt.read(m4::dwt::kCyccnt);
  std::uint32_t left = 1000;
  asm volatile("1: subs %0, %0, #1\nbne 1b" : "+r"(left));  // 2 000 instructions
  result(0) = kDwt.read(m4::dwt::kCyccnt) - begin;
}

void reset_twice() {
  result(0) = result(0) + 1;
  result(static_cast<int>(result(0))) = kRcc.read(reg::rcc::csr::kOffset);
  if (result(0) >= 3) stop();
  set(kRcc, reg::rcc::csr::kOffset, reg::rcc::csr::kRmvf.mask());
  kScs.write(m4::scb::kAircr, m4::scb::kVectkey(0x05FA) | m4::scb::kSysresetreq.mask());
  stop();
}

void fault_choice(std::uint32_t choice) {
  switch (choice) {
    case kUndefined:
      asm volatile("udf #0");
      return;
    case kUnmapped:
      result(20) = *reinterpret_cast<volatile std::uint32_t*>(0x6000'0004);
      return;
    case kFloatingPointOff:
      asm volatile("vmov s0, r0");
      return;
    case kUnalignedDouble:
      return unaligned("d");
    case kUnalignedFloat:
      enable_fpu();
      return unaligned("f");
    case kUnalignedWord:
      return unaligned("w");
    case kArmState:
      asm volatile("bx %0" ::"r"(0x0800'0100));
      return;
    case kLockup:
      asm volatile("udf #1");
      return;
    default:
      return;
  }
}

}  // namespace

void on_exception(std::uint32_t number, std::uint32_t* frame) {
  const std::uint32_t choice = shared().choice;
  if (number == 15 && choice == kFloatInHandler) {
    handler_sum = handler_sum * 1.5F + 0.25F > 100.0F ? 1.0F : handler_sum * 1.5F + 0.25F;
    result(3) = result(3) + 1;
    return;
  }
  if (number == 15) return mark(15);
  if (number >= 16 && choice == kInterruptNotCleared) return;
  if (number >= 16) {
    mark(number - 16);
    if (number == 28 && choice == kPriorities) {
      pend(11);
      pend(10);
      asm volatile("isb");
      mark(1000);
    }
    return;
  }
  if (number == 11) return mark(11);
  if (choice == kLockup) asm volatile("udf #2");
  result(30) = number;
  result(31) = kScs.read(m4::scb::kCfsr);
  result(32) = kScs.read(m4::scb::kHfsr);
  result(33) = kScs.read(m4::scb::kBfar);
  result(34) = kScs.read(m4::scb::kMmfar);
  result(35) = reinterpret_cast<std::uint32_t>(frame);
  if (choice != kStackGuard) result(36) = frame[6];
  stop();
}

void program_main() {
  const std::uint32_t choice = shared().choice;
  switch (choice) {
    case kFloatInHandler:
      enable_fpu();
      float_in_handler();
    case kMasks:
      masks();
      break;
    case kPriorities:
      priorities();
      break;
    case kSleep:
      sleep();
      break;
    case kStackGuard:
      stack_guard();
      break;
    case kReset:
      reset_twice();
      break;
    case kInterruptNotCleared:
      set(Mmio{reg::exti::kExti}, reg::exti::imr::kOffset, 1);
      enable_interrupt(reg::interrupt::kExti0, 3);
      set(Mmio{reg::exti::kExti}, reg::exti::swier::kOffset, 1);
      break;
    case kCycles:
      cycles();
      break;
    case kSupervisor:
      asm volatile("svc #0");
      mark(400);
      break;
    default:
      fault_choice(choice);
      break;
  }
  result(60) = 0x600D;
  stop();
}
