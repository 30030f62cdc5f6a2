// SPDX-License-Identifier: Apache-2.0
// Interrupt controller, priorities of exceptions, reset, and access to the floating-point unit. ARM DDI 0403E.e B3.2,
// B3.4. `Registers`: the system control space.
#pragma once

#include "hal/chip/arm/cortex_m4.hpp"

#include <cstdint>

namespace tetap::hal {

/// Priority of interrupts and SysTick: lower than that of the fault handlers, which stays 0. A fault in a handler keeps
/// its kind.
inline constexpr std::uint32_t kInterruptPriority = 0x80;

template <class Registers>
class Nvic {
 public:
  constexpr explicit Nvic(Registers registers) : registers_{registers} {}

  /// Nothing is enabled and nothing waits, whatever a boot loader left. Lines that a chip lacks ignore the write.
  void clear() const {
    constexpr std::uint32_t kMostLines = 240;  // of a Cortex-M4
    registers_.write(cortex_m4::systick::kCsr, 0);
    for (std::uint32_t word = 0; word < (kMostLines + 31) / 32; ++word) {
      registers_.write(cortex_m4::nvic::kIcer + 4 * word, ~std::uint32_t{0});
      registers_.write(cortex_m4::nvic::kIcpr + 4 * word, ~std::uint32_t{0});
    }
    registers_.write(cortex_m4::scb::kIcsr, cortex_m4::scb::kPendstclr.mask() | cortex_m4::scb::kPendsvclr.mask());
  }

  void enable(int interrupt) const {
    const auto number = static_cast<std::uint32_t>(interrupt);
    set_byte(cortex_m4::nvic::kIpr + number / 4 * 4, number % 4);
    registers_.write(cortex_m4::nvic::kIser + number / 32 * 4, std::uint32_t{1} << number % 32);
  }

  /// Faults have handlers of their own; SysTick has the priority of interrupts.
  void set_up_exceptions() const {
    registers_.write(cortex_m4::scb::kShcsr,
                     registers_.read(cortex_m4::scb::kShcsr) | cortex_m4::scb::kMemfaultena.mask() |
                         cortex_m4::scb::kBusfaultena.mask() | cortex_m4::scb::kUsgfaultena.mask());
    set_byte(cortex_m4::scb::kShpr3, 3);
  }

  [[noreturn]] void reset() const {
    constexpr std::uint32_t kKey = 0x05FA;
    const std::uint32_t group = registers_.read(cortex_m4::scb::kAircr) & cortex_m4::scb::kPrigroup.mask();
    registers_.write(cortex_m4::scb::kAircr,
                     cortex_m4::scb::kVectkey(kKey) | group | cortex_m4::scb::kSysresetreq.mask());
    for (;;) asm volatile("dsb" ::: "memory");
  }

 private:
  void set_byte(std::uint32_t offset, std::uint32_t byte) const {
    const Field field{static_cast<std::uint8_t>(8 * byte), 8};
    registers_.write(offset, field.in(registers_.read(offset), kInterruptPriority));
  }

  Registers registers_;
};

/// Full access, round to nearest with subnormals and NaN payloads kept as everywhere else, and the whole frame stacked
/// at once. Lazy stacking is off: with it a VDIV or VSQRT under a short handler may go wrong (ST errata sheet ES0305
/// rev. 9, 1.2; ARM 776924).
template <class Registers>
void enable_fpu(Registers registers) {
  constexpr std::uint32_t kFull = 3;
  registers.write(cortex_m4::scb::kCpacr,
                  registers.read(cortex_m4::scb::kCpacr) | cortex_m4::scb::kCp10(kFull) | cortex_m4::scb::kCp11(kFull));
  registers.write(cortex_m4::fpu::kFpccr, (registers.read(cortex_m4::fpu::kFpccr) | cortex_m4::fpu::kAspen.mask()) &
                                              ~cortex_m4::fpu::kLspen.mask());
  registers.write(cortex_m4::fpu::kFpdscr, 0);  // FPSCR of a handler
  asm volatile("dsb\nisb\nvmsr fpscr, %0" ::"r"(0) : "memory");
}

/// No access to the 32 bytes at `address`, a multiple of 32: what grows into them faults. ARM DDI 0403E.e B3.5.
template <class Registers>
void guard(Registers registers, std::uint32_t address) {
  constexpr std::uint32_t kSize32 = 4, kNoAccess = 0;
  registers.write(cortex_m4::mpu::kCtrl, 0);
  registers.write(cortex_m4::mpu::kRnr, 0);
  registers.write(cortex_m4::mpu::kRbar, address);
  registers.write(cortex_m4::mpu::kRasr, cortex_m4::mpu::kXn.mask() | cortex_m4::mpu::kAp(kNoAccess) |
                                             cortex_m4::mpu::kSize(kSize32) | cortex_m4::mpu::kRegionEnable.mask());
  registers.write(cortex_m4::mpu::kCtrl, cortex_m4::mpu::kEnable.mask() | cortex_m4::mpu::kPrivdefena.mask());
  asm volatile("dsb\nisb" ::: "memory");
}

}  // namespace tetap::hal
