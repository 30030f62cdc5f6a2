// SPDX-License-Identifier: Apache-2.0
// The part of the Thumb-2 encoding that the machine needs: lengths and floating-point instructions. It gives the
// register that holds the address of an access that must be aligned. ARM DDI 0403E.e chapter A5.
#pragma once

#include <cstdint>

namespace tetap::board::thumb {

/// The first half-word begins an instruction of 32 bits (A5.1).
[[nodiscard]] constexpr bool wide(std::uint16_t first) { return (first & 0xF800) >= 0xE800; }

/// Coprocessor 10 or 11: the floating-point unit (A6.4).
[[nodiscard]] constexpr bool floating_point(std::uint16_t first, std::uint16_t second) {
  return (first & 0xEC00) == 0xEC00 && (second & 0x0E00) == 0x0A00;
}

inline constexpr std::uint16_t kWfi = 0xBF30, kWfe = 0xBF20, kYield = 0xBF10;

/// Base register of an access that faults unless the address is a multiple of 4 (A3.2.1); -1: no such instruction.
/// Offsets of these encodings are multiples of 4.
[[nodiscard]] constexpr int aligned_base(std::uint16_t first, std::uint16_t second) {
  if ((first & 0xF000) == 0xC000) return first >> 8 & 7;  // LDM, STM (T1)
  if ((first & 0xFE40) == 0xE800 && ((first >> 7 & 3) == 1 || (first >> 7 & 3) == 2)) return first & 0xF;  // LDM, STM
  if ((first & 0xFE40) == 0xE840 && (first & 0x0120) != 0) return first & 0xF;                             // LDRD, STRD
  if ((first & 0xFFE0) == 0xE840) return first & 0xF;  // LDREX, STREX
  if ((first & 0xFE00) == 0xEC00 && (second & 0x0E00) == 0x0A00 && (first & 0xFFE0) != 0xEC40) {
    return first & 0xF;  // VLDR, VSTR, VLDM, VSTM
  }
  return -1;
}

}  // namespace tetap::board::thumb
