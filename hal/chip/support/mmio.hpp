// SPDX-License-Identifier: Apache-2.0
// A block of memory-mapped 32-bit registers. Drivers take it as a template parameter, so host tests hand them a model
// of the chip.
#pragma once

#include <cstdint>

namespace tetap::hal {

struct Mmio {
  std::uintptr_t base;

  [[nodiscard]] std::uint32_t read(std::uint32_t offset) const {
    // NOLINTNEXTLINE(performance-no-int-to-ptr): an address that the chip's manual gives
    return *reinterpret_cast<const volatile std::uint32_t*>(base + offset);
  }
  void write(std::uint32_t offset, std::uint32_t value) const {
    // NOLINTNEXTLINE(performance-no-int-to-ptr): the same
    *reinterpret_cast<volatile std::uint32_t*>(base + offset) = value;
  }
  /// For registers whose access size counts.
  [[nodiscard]] std::uint8_t read_byte(std::uint32_t offset) const {
    // NOLINTNEXTLINE(performance-no-int-to-ptr): the same
    return *reinterpret_cast<const volatile std::uint8_t*>(base + offset);
  }
  void write_byte(std::uint32_t offset, std::uint8_t value) const {
    // NOLINTNEXTLINE(performance-no-int-to-ptr): the same
    *reinterpret_cast<volatile std::uint8_t*>(base + offset) = value;
  }
};

}  // namespace tetap::hal
