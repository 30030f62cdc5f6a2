// SPDX-License-Identifier: Apache-2.0
// The packet of the scanners LD06, LD19 and STL-19P: 47 bytes at 230 400 baud, 12 points each, little-endian. Source:
// LDROBOT, LD19 development manual V2.3, sec. 3. Angles grow clockwise from the front, seen from above.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace tetap::drivers::ld19 {

inline constexpr std::size_t kPoints = 12, kPacketBytes = 47;
inline constexpr std::uint8_t kHeader = 0x54, kForm = 0x2C;  ///< kForm: type 1 in three bits, 12 points in five
inline constexpr std::uint32_t kBaud = 230'400;
inline constexpr std::int32_t kFullTurn_cdeg = 36'000;

/// CRC-8 of the manual's table: polynomial 0x4D, not reflected, from 0.
[[nodiscard]] constexpr std::uint8_t crc8(std::span<const std::uint8_t> bytes) {
  std::uint32_t crc = 0;
  for (const std::uint8_t byte : bytes) {
    crc ^= byte;
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 0x80) != 0 ? (crc << 1 ^ 0x4D) & 0xFF : crc << 1;
  }
  return static_cast<std::uint8_t>(crc);
}

struct Packet {
  std::int32_t speed_degps = 0;
  std::int32_t start_cdeg = 0;                       ///< clockwise angle of the first point, [0, 36 000)
  std::int32_t span_cdeg = 0;                        ///< from the first point to the last one
  std::array<std::uint16_t, kPoints> distance_mm{};  ///< 0: no return

  [[nodiscard]] constexpr std::int32_t angle_cdeg(std::size_t point) const {
    constexpr auto kSteps = static_cast<std::int32_t>(kPoints) - 1;
    return (start_cdeg + (span_cdeg * static_cast<std::int32_t>(point) + kSteps / 2) / kSteps) % kFullTurn_cdeg;
  }
};

/// Speeds to which the motor is controlled, 6 to 13 turns a second, with margin; and more than 12 points of 4 500 a
/// second then span.
inline constexpr std::int32_t kLeastSpeed_degps = 360, kMostSpeed_degps = 5'040, kMostSpan_cdeg = 3'000;

/// The packet in 47 bytes whose CRC fits. False: an angle that does not exist, or a motor that is not at its speed.
[[nodiscard]] constexpr bool decode(std::span<const std::uint8_t, kPacketBytes> bytes, Packet& packet) {
  const auto word = [bytes](std::size_t at) { return static_cast<std::uint16_t>(bytes[at] | bytes[at + 1] << 8); };
  const std::int32_t end_cdeg = word(42);
  packet.speed_degps = word(2);
  packet.start_cdeg = word(4);
  packet.span_cdeg = end_cdeg - packet.start_cdeg + (end_cdeg < packet.start_cdeg ? kFullTurn_cdeg : 0);
  for (std::size_t i = 0; i < kPoints; ++i) packet.distance_mm[i] = word(6 + 3 * i);
  return packet.speed_degps >= kLeastSpeed_degps && packet.speed_degps <= kMostSpeed_degps &&
         packet.start_cdeg < kFullTurn_cdeg && end_cdeg < kFullTurn_cdeg && packet.span_cdeg <= kMostSpan_cdeg;
}

}  // namespace tetap::drivers::ld19
