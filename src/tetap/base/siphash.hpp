// SPDX-License-Identifier: Apache-2.0
// SipHash-2-4: a keyed hash of short messages, no table. Aumasson and Bernstein, SipHash: a fast short-input PRF,
// INDOCRYPT 2012, section 2.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace tetap::base {

/// 128 bits; words are little-endian.
using SipKey = std::array<std::uint32_t, 4>;

class SipHash {
 public:
  explicit constexpr SipHash(const SipKey& key) {
    const std::uint64_t k0 = word(key[0], key[1]), k1 = word(key[2], key[3]);
    v_ = {k0 ^ 0x736F6D6570736575U, k1 ^ 0x646F72616E646F6DU, k0 ^ 0x6C7967656E657261U, k1 ^ 0x7465646279746573U};
  }

  constexpr void add(std::uint8_t byte) {
    word_ |= static_cast<std::uint64_t>(byte) << (8U * (size_ % 8U));
    if (++size_ % 8U == 0) compress();
  }
  constexpr void add(std::span<const std::uint8_t> bytes) {
    for (const std::uint8_t byte : bytes) add(byte);
  }
  /// 32 bits, the least significant byte first.
  constexpr void add_word(std::uint32_t value) {
    for (unsigned shift = 0; shift < 32; shift += 8) add(static_cast<std::uint8_t>(value >> shift));
  }

  /// Ends the message; not to be added to any more.
  [[nodiscard]] constexpr std::uint64_t finish() {
    word_ |= static_cast<std::uint64_t>(size_ & 0xFFU) << 56;
    compress();
    v_[2] ^= 0xFFU;
    rounds(4);
    return v_[0] ^ v_[1] ^ v_[2] ^ v_[3];
  }

 private:
  [[nodiscard]] static constexpr std::uint64_t word(std::uint32_t low, std::uint32_t high) {
    return static_cast<std::uint64_t>(high) << 32 | low;
  }
  [[nodiscard]] static constexpr std::uint64_t turned(std::uint64_t x, int bits) {
    return x << bits | x >> (64 - bits);
  }

  constexpr void compress() {
    v_[3] ^= word_;
    rounds(2);
    v_[0] ^= word_;
    word_ = 0;
  }
  /// Figure 2.1 of the paper.
  constexpr void rounds(int count) {
    for (int i = 0; i < count; ++i) {
      v_[0] += v_[1];
      v_[2] += v_[3];
      v_[1] = turned(v_[1], 13) ^ v_[0];
      v_[3] = turned(v_[3], 16) ^ v_[2];
      v_[0] = turned(v_[0], 32);
      v_[2] += v_[1];
      v_[0] += v_[3];
      v_[1] = turned(v_[1], 17) ^ v_[2];
      v_[3] = turned(v_[3], 21) ^ v_[0];
      v_[2] = turned(v_[2], 32);
    }
  }

  std::array<std::uint64_t, 4> v_{};
  std::uint64_t word_ = 0;  ///< bytes that are not compressed yet
  std::size_t size_ = 0;    ///< bytes added
};

}  // namespace tetap::base
