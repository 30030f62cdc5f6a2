// SPDX-License-Identifier: Apache-2.0
// The CRC of the version frame: the stored bits of the rows, in the order of the table. Bits on which no bit of an
// estimate depends are left out. The groups `wired` and `camera` count only where a robot has a wired sensor or a
// camera.
#pragma once

#include "tetap/base/bit_crc.hpp"
#include "tetap/param/table.hpp"

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
constexpr bool is_wired(std::size_t offset) {
  return offset >= offsetof(Parameters, wired) && offset < offsetof(Parameters, wired) + sizeof(WiredParameters);
}
constexpr bool is_camera(std::size_t offset) {
  return offset >= offsetof(Parameters, camera) && offset < offsetof(Parameters, camera) + sizeof(CameraParameters);
}
constexpr bool begins_run(std::size_t row) {
  if (row == 0) return true;
  const Row &now = kTable[row], &before = kTable[row - 1];
  return is_outside_crc(before) || now.offset != before.offset + before.size ||
         is_wired(now.offset) != is_wired(before.offset) || is_camera(now.offset) != is_camera(before.offset);
}
constexpr std::size_t runs_before(std::size_t row) {
  std::size_t runs = 0;
  for (std::size_t i = 0; i < row; ++i) runs += !is_outside_crc(kTable[i]) && begins_run(i) ? 1 : 0;
  return runs;
}
inline constexpr auto kRuns = [] {
  std::array<Run, runs_before(kTable.size())> runs{};
  std::size_t at = 0;
  for (std::size_t row = 0; row < kTable.size(); ++row) {
    if (is_outside_crc(kTable[row])) continue;
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
  for (const detail::Run& run : detail::kRuns) {
    if (detail::is_wired(run.offset) && !parameters.wired.any()) continue;
    if (detail::is_camera(run.offset) && !parameters.camera.any()) continue;
    for (std::size_t i = 0; i < run.size; i += 4) {
      std::uint32_t word = 0;
      std::memcpy(&word, bytes + run.offset + i, sizeof word);
      sum(word);
    }
  }
  return sum.value();
}

}  // namespace tetap::param
