// SPDX-License-Identifier: Apache-2.0
// A scope in which the NMI of the STM32G4's flash returns: two wrong bits of a double word that a power cut left are no
// end of the run. RM0440 3.3.3. Meanwhile the core has a vector table of its own; no interrupt runs.
#pragma once

#include "hal/chip/arm/cortex_m4.hpp"
#include "hal/chip/arm/interrupt_lock.hpp"
#include "hal/chip/stm32/registers_stm32g474.hpp"
#include "hal/chip/support/mmio.hpp"

#include <array>
#include <cstddef>
#include <cstdint>

extern "C" void tetap_exception();

namespace tetap::hal::stm32 {

class FlashEccTrap {
 public:
  explicit FlashEccTrap(Mmio flash) : before_{kSystem.read(cortex_m4::scb::kVtor)} {
    flash.write(stm32g474::flash::eccr::kOffset, kDamage);
    damage_ = 0;
    use(static_cast<std::uint32_t>(reinterpret_cast<std::uintptr_t>(&kVectors)));
  }
  ~FlashEccTrap() { use(before_); }
  FlashEccTrap(const FlashEccTrap&) = delete;
  FlashEccTrap& operator=(const FlashEccTrap&) = delete;

  /// ECCD and ECCD2 of the reads in this scope.
  [[nodiscard]] std::uint32_t damage() const {
    asm volatile("dsb\nisb" ::: "memory");
    return damage_;
  }

 private:
  using Handler = void (*)();
  struct Vectors {
    alignas(512) std::array<Handler, 16> handlers;
  };
  static constexpr std::uint32_t kDamage = stm32g474::flash::eccr::kEccd.mask() | stm32g474::flash::eccr::kEccd2.mask();
  static constexpr Mmio kSystem{cortex_m4::kSystemControlSpace};

  static void use(std::uint32_t vectors) {
    asm volatile("dsb" ::: "memory");
    kSystem.write(cortex_m4::scb::kVtor, vectors);
    asm volatile("dsb\nisb" ::: "memory");
  }
  /// An NMI of another source, the crystal's, is the fault that it always is.
  static void on_nmi() {
    constexpr Mmio kFlash{stm32g474::flash::kFlash};
    const std::uint32_t found = kFlash.read(stm32g474::flash::eccr::kOffset) & kDamage;
    if (found == 0) return tetap_exception();
    kFlash.write(stm32g474::flash::eccr::kOffset, found);
    damage_ = damage_ | found;
  }
  static constexpr Vectors make_vectors() {
    constexpr std::size_t kNmi = 2;
    Vectors table{};
    for (Handler& handler : table.handlers) handler = tetap_exception;
    table.handlers[kNmi] = on_nmi;
    return table;
  }
  static const Vectors kVectors;
  static inline volatile std::uint32_t damage_ = 0;

  InterruptLock lock_;
  std::uint32_t before_;
};

inline constexpr FlashEccTrap::Vectors FlashEccTrap::kVectors = make_vectors();

}  // namespace tetap::hal::stm32
