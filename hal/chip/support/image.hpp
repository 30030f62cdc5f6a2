// SPDX-License-Identifier: Apache-2.0
// Start of every flashed image before main(), and its own measurements after: sections copied and zeroed, the stack
// painted and measured. The symbols come from the port's link.ld; the paint is put there by the port's reset code,
// which has no stack yet.
#pragma once

#include "hal/board_report.hpp"

#include <cstdint>
#include <cstring>

extern "C" {
// Addresses only: the linker gives these names a place, nothing is stored under them.
// NOLINTBEGIN(bugprone-reserved-identifier): link.ld makes these names
extern std::uint32_t __data_start[], __data_end[], __data_load[];
extern std::uint32_t __bss_start[], __bss_end[];
extern std::uint32_t __stack_bottom[], __stack_top[];
// NOLINTEND(bugprone-reserved-identifier)
}

namespace tetap::hal {

/// Every word of the stack's reservation holds this before main(); the same number stands in the ports' reset code.
inline constexpr std::uint32_t kStackPaint = 0xA5A5A5A5;

/// .data from where it was flashed, .bss to zero. There is nothing else to run: link.ld refuses static constructors.
inline void load_sections() {
  std::memcpy(__data_start, __data_load,
              reinterpret_cast<std::uintptr_t>(__data_end) - reinterpret_cast<std::uintptr_t>(__data_start));
  std::memset(__bss_start, 0,
              reinterpret_cast<std::uintptr_t>(__bss_end) - reinterpret_cast<std::uintptr_t>(__bss_start));
}

[[nodiscard]] inline StackUse stack_use() {
  const auto reserved =
      reinterpret_cast<std::uintptr_t>(__stack_top) - reinterpret_cast<std::uintptr_t>(__stack_bottom);
  const volatile std::uint32_t* word = __stack_bottom;
  std::uintptr_t clean = 0;
  while (clean < reserved && *word == kStackPaint) {
    ++word;
    clean += sizeof(std::uint32_t);
  }
  return {.reserved = static_cast<std::uint32_t>(reserved), .used = static_cast<std::uint32_t>(reserved - clean)};
}

}  // namespace tetap::hal
