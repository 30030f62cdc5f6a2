// SPDX-License-Identifier: Apache-2.0
// Bytes of the scanner RPLIDAR A1 at 115 200 baud: requests, descriptors of responses, health, and the measurement of a
// standard scan. Source: Slamtec, RPLIDAR Interface Protocol and Application Notes, rev. 1.1 (A1 and A2), 2018. Angles
// grow clockwise from the front, seen from above.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace tetap::drivers::rplidar {

inline constexpr std::uint32_t kBaud = 115'200;
inline constexpr std::size_t kNodeBytes = 5, kDescriptorBytes = 7, kHealthBytes = 3;
inline constexpr std::int32_t kTurn_q6 = 360 * 64;

using Request = std::array<std::uint8_t, 2>;
inline constexpr Request kAskStop{0xA5, 0x25}, kAskReset{0xA5, 0x40}, kAskScan{0xA5, 0x20}, kAskHealth{0xA5, 0x52};

/// Descriptor of a response: two bytes of start, 30 bits of length, two of mode (1: many packets), one of type.
using Descriptor = std::array<std::uint8_t, kDescriptorBytes>;
inline constexpr Descriptor kScanFollows{0xA5, 0x5A, 0x05, 0x00, 0x00, 0x40, 0x81};
inline constexpr Descriptor kHealthFollows{0xA5, 0x5A, 0x03, 0x00, 0x00, 0x00, 0x06};

/// Status of the scanner's own check; kError: it measures nothing until a reset.
enum class Status : std::uint8_t { kGood = 0, kWarning = 1, kError = 2 };

struct Node {
  bool starts_turn = false;
  std::uint8_t quality = 0;      ///< strength of the return, 0 to 63
  std::int32_t angle_q6 = 0;     ///< clockwise, 1/64 deg, [0, 360 deg)
  std::int32_t distance_mm = 0;  ///< 0: no return

  [[nodiscard]] constexpr std::int32_t angle_cdeg() const { return angle_q6 * 25 / 16; }
};

/// Empty: the start bit equals its inverse, the check bit is 0, or the angle does not exist.
[[nodiscard]] constexpr std::optional<Node> decode(std::span<const std::uint8_t> b) {
  if (b.size() < kNodeBytes) return {};
  const bool start = (b[0] & 1) != 0, no_start = (b[0] & 2) != 0;
  const auto word = [&b](std::size_t at) { return static_cast<std::int32_t>(b[at] | b[at + 1] << 8); };
  const std::int32_t angle_q6 = word(1) >> 1;
  if (start == no_start || (b[1] & 1) == 0 || angle_q6 >= kTurn_q6) return {};
  return Node{.starts_turn = start,
              .quality = static_cast<std::uint8_t>(b[0] >> 2),
              .angle_q6 = angle_q6,
              .distance_mm = (word(3) + 2) / 4};
}

}  // namespace tetap::drivers::rplidar
