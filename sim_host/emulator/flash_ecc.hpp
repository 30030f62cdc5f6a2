// SPDX-License-Identifier: Apache-2.0
// Eight check bits over a double word of flash: one wrong bit of the 72 is found and corrected, two are found. The
// chip's own code is not published. This one is of Hsiao's kind (IBM J. Res. Dev. 14(4), 1970): columns of odd weight.
// A blank double word (72 ones) and one of zeros are both valid, as the chip needs them.
#pragma once

#include <array>
#include <bit>
#include <cstdint>

namespace tetap::board::ecc {

/// Syndrome of each data bit: all bytes of weight five, and eight of weight three whose sum is 0.
inline constexpr std::array<std::uint8_t, 64> kColumns = [] {
  std::array<std::uint8_t, 64> columns{0x07, 0x0B, 0x0D, 0x0E, 0x13, 0x15, 0x23, 0x2A};
  std::size_t next = 8;
  for (unsigned byte = 0; byte < 256; ++byte)
    if (std::popcount(byte) == 5) columns[next++] = static_cast<std::uint8_t>(byte);
  return columns;
}();

[[nodiscard]] constexpr std::uint8_t check_bits(std::uint64_t data) {
  std::uint8_t sum = 0;
  for (std::size_t bit = 0; bit < 64; ++bit)
    if ((data >> bit & 1) != 0) sum ^= kColumns[bit];
  return sum;
}

enum class Verdict : std::uint8_t { kFine, kCorrected, kWrong };
struct Read {
  std::uint64_t data;
  Verdict verdict;
};

[[nodiscard]] constexpr Read read(std::uint64_t data, std::uint8_t check) {
  const auto syndrome = static_cast<std::uint8_t>(check_bits(data) ^ check);
  if (syndrome == 0) return {data, Verdict::kFine};
  if (std::has_single_bit(syndrome)) return {data, Verdict::kCorrected};  // a check bit
  for (std::size_t bit = 0; bit < 64; ++bit)
    if (kColumns[bit] == syndrome) return {data ^ std::uint64_t{1} << bit, Verdict::kCorrected};
  return {data, Verdict::kWrong};
}

}  // namespace tetap::board::ecc
