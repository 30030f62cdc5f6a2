// SPDX-License-Identifier: Apache-2.0
// Bytes of a scanner's serial line, each with the number of those that were read behind it.
#pragma once

#include "tetap/base/time.hpp"

#include <array>
#include <cstddef>
#include <cstdint>

namespace tetap::drivers {

/// Time of bytes of ten bits on the line.
[[nodiscard]] constexpr base::Micros line_time(std::size_t bytes, std::uint32_t baud) {
  return {static_cast<std::int64_t>(bytes) * 10'000'000 / std::int64_t{baud}};
}

/// Calls `take(byte, after)` for what the port has, 1 kB at the most; `after`: bytes of the same read behind it.
template <class Port, class Take>
constexpr void read_line(Port& port, Take&& take) {
  constexpr int kReads = 16;
  std::array<std::uint8_t, 64> bytes{};
  for (int reads = 0; reads < kReads; ++reads) {
    const std::size_t n = port.read(bytes);
    if (n == 0 || n > bytes.size()) return;
    for (std::size_t i = 0; i < n; ++i) take(bytes[i], n - 1 - i);
  }
}

}  // namespace tetap::drivers
