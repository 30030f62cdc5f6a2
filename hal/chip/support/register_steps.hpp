// SPDX-License-Identifier: Apache-2.0
// Steps that set a block up: bits set and cleared, and a wait that ends.
#pragma once

#include "hal/chip/support/register_field.hpp"

#include <cstdint>

namespace tetap::hal {

template <class Registers>
void set_bits(Registers block, std::uint32_t offset, std::uint32_t bits) {
  block.write(offset, block.read(offset) | bits);
}
template <class Registers>
void clear_bits(Registers block, std::uint32_t offset, std::uint32_t bits) {
  block.write(offset, block.read(offset) & ~bits);
}
/// False: `patience` reads did not see the value.
template <class Registers>
[[nodiscard]] bool waits_for(Registers block, std::uint32_t offset, Field field, std::uint32_t value, int patience) {
  for (int i = 0; i < patience; ++i) {
    if (field.of(block.read(offset)) == value) return true;
  }
  return false;
}

}  // namespace tetap::hal
