// SPDX-License-Identifier: Apache-2.0
// Flash and SRAM of a chip, and what the core and the other bus masters see of them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

namespace tetap::board {

/// Sizes, and the part of the SRAM that the core sees at a second address as well.
struct MemoryLayout {
  std::uint32_t flash_size, ram_size;
  std::uint32_t alias = 0, alias_size = 0;  ///< second address of the SRAM's last `alias_size` bytes; 0: none
};

class Memory {
 public:
  static constexpr std::uint32_t kFlash = 0x0800'0000, kRam = 0x2000'0000;

  static constexpr std::byte kAfterPowerOn{0xCD};

  /// An erased flash reads 0xFF; SRAM is filled with a pattern, as nothing may rely on what power-on leaves there.
  explicit Memory(const MemoryLayout& layout)
      : layout_(layout), flash_(layout.flash_size, std::byte{0xFF}), ram_(layout.ram_size, kAfterPowerOn) {}

  [[nodiscard]] std::span<std::byte> flash() { return flash_; }
  [[nodiscard]] std::span<std::byte> ram() { return ram_; }
  [[nodiscard]] std::uint32_t flash_size() const { return layout_.flash_size; }
  [[nodiscard]] std::uint32_t ram_size() const { return layout_.ram_size; }
  [[nodiscard]] const MemoryLayout& layout() const { return layout_; }
  /// The SRAM that the core sees at layout().alias.
  [[nodiscard]] std::span<std::byte> aliased() { return ram().last(layout_.alias_size); }

  /// Where the core's access to `address` goes: the flash is seen at 0 as well (BOOT0 = 0), the SRAM's end at its
  /// alias.
  [[nodiscard]] std::uint32_t resolve(std::uint32_t address) const {
    if (address < layout_.flash_size) return address + kFlash;
    if (address - layout_.alias < layout_.alias_size)
      return kRam + layout_.ram_size - layout_.alias_size + (address - layout_.alias);
    return address;
  }
  [[nodiscard]] bool in_ram(std::uint32_t address) const { return resolve(address) - kRam < layout_.ram_size; }

  /// `size` bytes at `address` that a bus master may read; empty: nothing there.
  [[nodiscard]] std::span<const std::byte> readable(std::uint32_t address, std::size_t size) const {
    if (inside(address, size, kRam, layout_.ram_size)) return {ram_.data() + (address - kRam), size};
    if (inside(address, size, kFlash, layout_.flash_size)) return {flash_.data() + (address - kFlash), size};
    return {};
  }
  /// `size` bytes of SRAM; empty: none there.
  [[nodiscard]] std::span<std::byte> writable(std::uint32_t address, std::size_t size) {
    if (inside(address, size, kRam, layout_.ram_size)) return {ram_.data() + (address - kRam), size};
    return {};
  }
  /// The core's words.
  [[nodiscard]] bool read_word(std::uint32_t address, std::uint32_t& word) const {
    const auto bytes = readable(resolve(address), 4);
    if (bytes.empty()) return false;
    std::memcpy(&word, bytes.data(), 4);
    return true;
  }
  [[nodiscard]] bool write_word(std::uint32_t address, std::uint32_t word) {
    const auto bytes = writable(resolve(address), 4);
    if (bytes.empty()) return false;
    std::memcpy(bytes.data(), &word, 4);
    return true;
  }

 private:
  static bool inside(std::uint32_t address, std::size_t size, std::uint32_t base, std::uint32_t length) {
    return address >= base && std::size_t{address - base} + size <= length;
  }

  MemoryLayout layout_;
  std::vector<std::byte> flash_, ram_;
};

}  // namespace tetap::board
