// SPDX-License-Identifier: Apache-2.0
// A field of a memory-mapped register: its place in the word. Generated register headers are made of these.
#pragma once

#include <cstdint>

namespace tetap::hal {

/// `width` bits from bit `lsb` on.
struct Field {
  std::uint8_t lsb = 0;
  std::uint8_t width = 1;

  /// The field's bits in the word.
  [[nodiscard]] constexpr std::uint32_t mask() const {
    return (width >= 32 ? ~std::uint32_t{0} : (std::uint32_t{1} << width) - 1) << lsb;
  }
  /// `value` at the field's place; bits beyond the width are cut.
  [[nodiscard]] constexpr std::uint32_t operator()(std::uint32_t value) const { return (value << lsb) & mask(); }
  /// The field's value in `word`.
  [[nodiscard]] constexpr std::uint32_t of(std::uint32_t word) const { return (word & mask()) >> lsb; }
  /// `word` with the field replaced.
  [[nodiscard]] constexpr std::uint32_t in(std::uint32_t word, std::uint32_t value) const {
    return (word & ~mask()) | (*this)(value);
  }
};

}  // namespace tetap::hal
