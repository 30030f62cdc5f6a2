// SPDX-License-Identifier: Apache-2.0
// One line of candump's log form, "(seconds) interface 123#DEADBEEF", as a frame; candump(1), option -L.
#pragma once

#include "tetap/base/can_frame.hpp"

#include <cstddef>
#include <cstdint>
#include <optional>

namespace tetap::hal::mps2 {

/// The frame in one line of a candump log; empty for anything else (remote, CAN FD and error frames too).
[[nodiscard]] constexpr std::optional<base::CanFrame> parse_candump(const char* line, std::size_t size) {
  const auto nibble = [](char c) {
    return c >= '0' && c <= '9'   ? c - '0'
           : c >= 'A' && c <= 'F' ? c - 'A' + 10
           : c >= 'a' && c <= 'f' ? c - 'a' + 10
                                  : -1;
  };
  std::size_t at = size;  // the frame is the third word
  for (std::size_t i = 0, words = 0; i + 1 < size; ++i) {
    if (line[i] == ' ' && line[i + 1] != ' ' && ++words == 2) {
      at = i + 1;
      break;
    }
  }
  base::CanFrame frame;
  std::size_t digits = 0;
  for (; at < size && nibble(line[at]) >= 0 && digits < 9; ++at, ++digits)
    frame.id = frame.id << 4 | static_cast<std::uint32_t>(nibble(line[at]));
  if (at >= size || line[at] != '#' || (digits != 3 && digits != 8)) return std::nullopt;
  frame.extended = digits == 8;
  if (frame.id > (frame.extended ? 0x1FFF'FFFFU : 0x7FFU)) return std::nullopt;
  for (++at; at + 1 < size && frame.size < frame.data.size(); at += 2) {
    const int high = nibble(line[at]);
    const int low = nibble(line[at + 1]);
    if (high < 0 || low < 0) break;
    frame.data[frame.size++] = static_cast<std::uint8_t>(high << 4 | low);
  }
  const bool ends = at >= size || line[at] == ' ' || line[at] == '\r' || line[at] == '\n';
  return ends ? std::optional{frame} : std::nullopt;
}

}  // namespace tetap::hal::mps2
