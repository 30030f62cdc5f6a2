// SPDX-License-Identifier: Apache-2.0
// CRC-32 (IEEE 802.3, reflected), CRC-16/IBM-3740 (polynomial 0x1021) and CRC-8 H2F (polynomial 0x2F). The last two are
// as in AUTOSAR CP SWS_CRCLibrary. All go byte by byte, also at compile time. Tables: 1 kB, 32 and 16 bytes. Check
// values over "123456789": 0xCBF43926, 0x29B1 and 0xDF.
#pragma once

#include <array>
#include <cstdint>
#include <span>

namespace tetap::base {

class Crc32 {
 public:
  constexpr Crc32() = default;
  /// Goes on from the value() of what came before.
  explicit constexpr Crc32(std::uint32_t earlier) : state_(~earlier) {}

  constexpr void add(std::uint8_t byte) { state_ = (state_ >> 8) ^ kTable[(state_ ^ byte) & 0xFFU]; }
  constexpr void add(std::span<const std::uint8_t> bytes) {
    for (const std::uint8_t byte : bytes) add(byte);
  }
  [[nodiscard]] constexpr std::uint32_t value() const { return ~state_; }

 private:
  // 1 kB of flash: every frame that is consumed passes through it.
  static constexpr std::array<std::uint32_t, 256> kTable = [] {
    std::array<std::uint32_t, 256> table{};
    for (std::uint32_t byte = 0; byte < 256; ++byte) {
      std::uint32_t crc = byte;
      for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1) ^ ((crc & 1U) != 0 ? 0xEDB88320U : 0U);
      table[byte] = crc;
    }
    return table;
  }();
  std::uint32_t state_ = 0xFFFFFFFFU;
};

class Crc16 {
 public:
  constexpr void add(std::uint8_t byte) {
    for (int shift = 4; shift >= 0; shift -= 4) shift_nibble(byte >> shift & 0x0F);
  }
  constexpr void add(std::span<const std::uint8_t> bytes) {
    for (const std::uint8_t byte : bytes) add(byte);
  }
  [[nodiscard]] constexpr std::uint16_t value() const { return state_; }

 private:
  static constexpr std::array<std::uint16_t, 16> kTable = [] {
    std::array<std::uint16_t, 16> table{};
    for (unsigned nibble = 0; nibble < 16; ++nibble) {
      unsigned crc = nibble << 12;
      for (int bit = 0; bit < 4; ++bit) crc = (crc << 1) ^ ((crc & 0x8000U) != 0 ? 0x1021U : 0U);
      table[nibble] = static_cast<std::uint16_t>(crc & 0xFFFFU);
    }
    return table;
  }();
  constexpr void shift_nibble(int nibble) {
    const unsigned top = (static_cast<unsigned>(state_) >> 12) ^ static_cast<unsigned>(nibble);
    state_ = static_cast<std::uint16_t>(((static_cast<unsigned>(state_) << 4) ^ kTable[top]) & 0xFFFFU);
  }
  std::uint16_t state_ = 0xFFFF;
};

class Crc8H2f {
 public:
  constexpr void add(std::uint8_t byte) {
    state_ ^= byte;
    shift_nibble();
    shift_nibble();
  }
  constexpr void add(std::span<const std::uint8_t> bytes) {
    for (const std::uint8_t byte : bytes) add(byte);
  }
  [[nodiscard]] constexpr std::uint8_t value() const { return static_cast<std::uint8_t>(state_ ^ 0xFFU); }

 private:
  static constexpr std::array<std::uint8_t, 16> kTable = [] {
    std::array<std::uint8_t, 16> table{};
    for (unsigned nibble = 0; nibble < 16; ++nibble) {
      unsigned crc = nibble << 4;
      for (int bit = 0; bit < 4; ++bit) crc = (crc << 1) ^ ((crc & 0x80U) != 0 ? 0x2FU : 0U);
      table[nibble] = static_cast<std::uint8_t>(crc & 0xFFU);
    }
    return table;
  }();
  constexpr void shift_nibble() {
    const unsigned top = state_ >> 4;
    state_ = static_cast<std::uint8_t>(((static_cast<unsigned>(state_) << 4) ^ kTable[top]) & 0xFFU);
  }
  std::uint8_t state_ = 0xFF;
};

}  // namespace tetap::base
