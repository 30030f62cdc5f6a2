// SPDX-License-Identifier: Apache-2.0
// CRC-32 over the raw bits of numbers, least significant byte first: of inputs and parameters.
#pragma once

#include "tetap/base/crc.hpp"

#include <bit>
#include <cstdint>

namespace tetap::base {

class BitCrc {
 public:
  constexpr BitCrc() = default;
  /// Goes on from an earlier value().
  explicit constexpr BitCrc(std::uint32_t earlier) : crc_(earlier) {}

  constexpr void operator()(std::uint32_t word) {
    for (int shift = 0; shift < 32; shift += 8) crc_.add(static_cast<std::uint8_t>(word >> shift));
  }
  constexpr void operator()(std::int32_t word) { (*this)(static_cast<std::uint32_t>(word)); }
  constexpr void operator()(float number) { (*this)(std::bit_cast<std::uint32_t>(number)); }
  constexpr void operator()(std::int64_t word) {
    (*this)(static_cast<std::uint32_t>(static_cast<std::uint64_t>(word)));
    (*this)(static_cast<std::uint32_t>(static_cast<std::uint64_t>(word) >> 32));
  }
  [[nodiscard]] constexpr std::uint32_t value() const { return crc_.value(); }

 private:
  Crc32 crc_;
};

}  // namespace tetap::base
