// SPDX-License-Identifier: Apache-2.0
// The CRC of the version frame: the stored bits of every row, in the order of the table. The group `wired` counts only
// where a robot has a wired sensor.
#pragma once

#include "base/bit_crc.hpp"
#include "param/table.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace tetap::param {

namespace detail {
/// Rows that lie behind each other in the struct as in the table: the part of the table that a flash image keeps.
struct Run {
  std::uint16_t offset;
  std::uint16_t size;
};
/// Row of the first wired parameter. Its group is the last, and the CRC of a robot without wired sensors ends before
/// it.
inline constexpr std::size_t kFirstWiredRow = [] {
  std::size_t row = 0;
  while (kTable[row].offset < offsetof(Parameters, wired)) ++row;
  return row;
}();
constexpr bool begins_run(std::size_t row) {
  return row == 0 || row == kFirstWiredRow || kTable[row].offset != kTable[row - 1].offset + kTable[row - 1].size;
}
constexpr std::size_t runs_before(std::size_t row) {
  std::size_t runs = 0;
  for (std::size_t i = 0; i < row; ++i) runs += begins_run(i) ? 1 : 0;
  return runs;
}
inline constexpr std::size_t kUnwiredRuns = runs_before(kFirstWiredRow);
inline constexpr auto kRuns = [] {
  std::array<Run, runs_before(kTable.size())> runs{};
  std::size_t at = 0;
  for (std::size_t row = 0; row < kTable.size(); ++row) {
    if (begins_run(row)) runs[at++] = {static_cast<std::uint16_t>(kTable[row].offset), 0};
    runs[at - 1].size = static_cast<std::uint16_t>(runs[at - 1].size + kTable[row].size);
  }
  return runs;
}();
}  // namespace detail

/// Small rather than fast: it runs once, at the start.
[[nodiscard]] inline std::uint32_t crc(const Parameters& parameters) {
  const auto* bytes = reinterpret_cast<const unsigned char*>(&parameters);
  base::BitCrc sum;
  const std::size_t runs = parameters.wired.any() ? detail::kRuns.size() : detail::kUnwiredRuns;
  for (std::size_t run = 0; run < runs; ++run)
    for (std::size_t i = 0; i < detail::kRuns[run].size; i += 4) {
      std::uint32_t word = 0;
      std::memcpy(&word, bytes + detail::kRuns[run].offset + i, sizeof word);
      sum(word);
    }
  return sum.value();
}

}  // namespace tetap::param
