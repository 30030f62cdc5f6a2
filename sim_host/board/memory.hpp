// SPDX-License-Identifier: Apache-2.0
// Flash and SRAM of the STM32F412xG: RM0402 chapter "Memory and bus architecture", table of the memory map. The first
// megabyte is an alias of the flash (BOOT0 = 0).
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

namespace tetap::board {

class Memory {
 public:
  static constexpr std::uint32_t kFlash = 0x0800'0000, kFlashSize = 1U << 20, kRam = 0x2000'0000, kRamSize = 256U << 10;

  /// An erased flash reads 0xFF; SRAM is filled with a pattern, as nothing may rely on what power-on leaves there.
  Memory() : flash_(kFlashSize, std::byte{0xFF}), ram_(kRamSize, std::byte{0xCD}) {}

  [[nodiscard]] std::span<std::byte> flash() { return flash_; }
  [[nodiscard]] std::span<std::byte> ram() { return ram_; }

  /// `size` bytes at `address` that a bus master may read; empty: nothing there.
  [[nodiscard]] std::span<const std::byte> readable(std::uint32_t address, std::size_t size) const {
    if (inside(address, size, kRam, kRamSize)) return {ram_.data() + (address - kRam), size};
    if (inside(address, size, kFlash, kFlashSize)) return {flash_.data() + (address - kFlash), size};
    return {};
  }
  /// `size` bytes of SRAM; empty: none there.
  [[nodiscard]] std::span<std::byte> writable(std::uint32_t address, std::size_t size) {
    if (inside(address, size, kRam, kRamSize)) return {ram_.data() + (address - kRam), size};
    return {};
  }
  [[nodiscard]] bool read_word(std::uint32_t address, std::uint32_t& word) const {
    const auto bytes = readable(address < kFlashSize ? address + kFlash : address, 4);
    if (bytes.empty()) return false;
    std::memcpy(&word, bytes.data(), 4);
    return true;
  }
  [[nodiscard]] bool write_word(std::uint32_t address, std::uint32_t word) {
    const auto bytes = writable(address, 4);
    if (bytes.empty()) return false;
    std::memcpy(bytes.data(), &word, 4);
    return true;
  }

 private:
  static bool inside(std::uint32_t address, std::size_t size, std::uint32_t base, std::uint32_t length) {
    return address >= base && std::size_t{address - base} + size <= length;
  }

  std::vector<std::byte> flash_, ram_;
};

}  // namespace tetap::board
