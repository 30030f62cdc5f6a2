// SPDX-License-Identifier: Apache-2.0
// The packets of the ICM-42688-P's FIFO, bytes to numbers and numbers to SI; nothing here talks to a chip.
// DS-000347 rev. 1.8, 6.1 (packets 3 and 4), 6.2 (header), 12.8 and 14.34 (markers), 3.1, 3.2 and 4.13 (scales).
#pragma once

#include "drivers/imu/icm42688/settings.hpp"
#include "tetap/base/math.hpp"

#include <array>
#include <cstdint>
#include <span>

namespace tetap::drivers::icm42688 {

enum class PacketKind : std::uint8_t {
  kSample,
  kInvalid,  ///< a marker, or no new data: well-formed, but not to be used
  kEmpty,    ///< the FIFO had nothing more
  kForeign   ///< not what was configured: the reader is out of step or in another bank
};

struct Packet {
  PacketKind kind = PacketKind::kForeign;
  bool rate_changed = false;  ///< the header marks a data rate other than that of the packet before
  std::array<std::int32_t, 3> accel{};
  std::array<std::int32_t, 3> gyro{};
  std::int16_t temperature = 0;
  std::uint16_t ticks = 0;
};

[[nodiscard]] constexpr std::uint16_t big_endian(std::uint8_t high, std::uint8_t low) {
  return static_cast<std::uint16_t>(high << 8 | low);
}
[[nodiscard]] constexpr std::int16_t signed_big_endian(std::uint8_t high, std::uint8_t low) {
  return static_cast<std::int16_t>(big_endian(high, low));
}

inline constexpr std::uint8_t kHeaderEmpty = 0x80, kHeaderRates = 0x03;
inline constexpr std::uint8_t kHeader16 = 0x68, kHeader20 = 0x78;  // 6.4: acceleration, rate, stamp (and extension)
inline constexpr std::int32_t kMarker16 = -32'768, kMarker20 = -524'288;

/// `bytes` holds one packet of the configured size.
[[nodiscard]] constexpr Packet parse(std::span<const std::uint8_t> bytes, Resolution resolution) {
  Packet packet{};
  const std::uint8_t header = bytes[0];
  if ((header & kHeaderEmpty) != 0) return packet.kind = PacketKind::kEmpty, packet;
  const bool wide = resolution == Resolution::k20bit;
  const std::uint8_t layout = header & static_cast<std::uint8_t>(~kHeaderRates);
  if (layout != kHeader16 && !(wide && layout == kHeader20)) return packet;
  packet.rate_changed = (header & kHeaderRates) != 0;
  packet.kind = PacketKind::kSample;
  const std::int32_t marker = wide ? kMarker20 : kMarker16;
  for (std::size_t i = 0; i < 3; ++i) {
    std::int32_t accel = signed_big_endian(bytes[1 + 2 * i], bytes[2 + 2 * i]);
    std::int32_t gyro = signed_big_endian(bytes[7 + 2 * i], bytes[8 + 2 * i]);
    if (wide) {
      const std::uint8_t low = bytes[17 + i];
      accel = accel * 16 + (low >> 4);
      gyro = gyro * 16 + (low & 0x0F);
    }
    packet.accel[i] = accel;
    packet.gyro[i] = gyro;
    if (accel == marker || gyro == marker) packet.kind = PacketKind::kInvalid;
  }
  if (wide) {
    packet.temperature = signed_big_endian(bytes[13], bytes[14]);
  } else {
    packet.temperature = static_cast<std::int8_t>(bytes[13]);  // NOLINT(bugprone-signed-char-misuse): it has a sign
  }
  packet.ticks = wide ? big_endian(bytes[15], bytes[16]) : big_endian(bytes[14], bytes[15]);
  // 6.2: in a packet of 20 bytes without this bit the extension is not new.
  if (wide && layout != kHeader20) packet.kind = PacketKind::kInvalid;
  return packet;
}

/// Numbers per unit, and where the sensor ends.
struct Scales {
  float rate_radps;    ///< per count
  float force_mps2;    ///< per count
  float temperature;   ///< degrees per count
  std::int32_t limit;  ///< counts, of both
};

inline constexpr float kStandardGravity_mps2 = 9.80665F;
inline constexpr float kRadiansPerDegree = 0.0174532925F;

[[nodiscard]] constexpr Scales scales(const Settings& s) {
  if (s.resolution == Resolution::k20bit) {
    // 6.1: 131 per deg/s of 19 bits and 8192 per g of 18: the one and the two bits below them are always 0. Full scale
    // is that of the code, so the upper 16 bits are the packet of 16 bits.
    return {kRadiansPerDegree / (2 * 131.0F), kStandardGravity_mps2 / (4 * 8192.0F), 1.0F / 132.48F, 524'256};
  }
  // Tables 1 and 2; 14.34: -32766 is the lowest valid value.
  constexpr float kPerDps[8] = {16.4F, 32.8F, 65.5F, 131.0F, 262.0F, 524.3F, 1048.6F, 2097.2F};
  constexpr float kPerG[4] = {2048.0F, 4096.0F, 8192.0F, 16384.0F};
  return {kRadiansPerDegree / kPerDps[static_cast<std::size_t>(s.gyro_range)],
          kStandardGravity_mps2 / kPerG[static_cast<std::size_t>(s.accel_range)], 1.0F / 2.07F, 32'766};
}

[[nodiscard]] constexpr bool beyond(const std::array<std::int32_t, 3>& counts, std::int32_t limit) {
  for (const std::int32_t count : counts) {
    if (count >= limit || count <= -limit) return true;
  }
  return false;
}

[[nodiscard]] constexpr Vector3 scaled(const std::array<std::int32_t, 3>& counts, float unit) {
  // Below 2^24, so the conversions are exact.
  return {static_cast<float>(counts[0]) * unit, static_cast<float>(counts[1]) * unit,
          static_cast<float>(counts[2]) * unit};
}

/// NaN where the chip marks it invalid; in eight bits that is also the end of the range.
[[nodiscard]] constexpr float temperature_degC(const Packet& packet, Resolution resolution, const Scales& scale) {
  const std::int16_t marker = resolution == Resolution::k20bit ? std::int16_t{-32'768} : std::int16_t{-128};
  if (packet.temperature == marker) return base::kNan;
  return static_cast<float>(packet.temperature) * scale.temperature + 25.0F;
}

}  // namespace tetap::drivers::icm42688
