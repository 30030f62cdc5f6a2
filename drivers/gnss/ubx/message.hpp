// SPDX-License-Identifier: Apache-2.0
// UBX messages to the receiver, whole frames: u-blox F9 HPG 1.32 interface description (UBX-22008968), sec. 3.10
// UBX-CFG-VALSET, 3.14 UBX-MON-VER, sec. 5 (keys); u-blox 8 / M8 protocol specification (UBX-13003221), sec. 32.11:
// UBX-CFG-PRT, -RATE, -MSG, -NAV5.
#pragma once

#include "drivers/gnss/framer.hpp"
#include "drivers/gnss/ubx/nav.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace tetap::drivers::gnss::ubx {

/// Built field by field; the length and the checksum come with frame().
class Message {
 public:
  static constexpr std::size_t kCapacity = 64;

  constexpr Message() = default;
  constexpr Message(std::uint8_t message_class, std::uint8_t id) {
    for (const std::uint8_t byte : {kUbxSync1, kUbxSync2, message_class, id, std::uint8_t{0}, std::uint8_t{0}})
      u1(byte);
  }
  constexpr Message& u1(std::uint32_t value) {
    if (size_ < kCapacity - 2) {
      bytes_[size_] = static_cast<std::uint8_t>(value & 0xFF);
      ++size_;
    }
    return *this;
  }
  constexpr Message& u2(std::uint32_t value) { return u1(value).u1(value >> 8); }
  constexpr Message& u4(std::uint32_t value) { return u2(value).u2(value >> 16); }
  constexpr Message& zeros(int n) {
    for (int i = 0; i < n; ++i) u1(0);
    return *this;
  }
  [[nodiscard]] constexpr Message& finish() {
    const std::size_t payload = size_ - 6;
    bytes_[4] = static_cast<std::uint8_t>(payload & 0xFF);
    bytes_[5] = static_cast<std::uint8_t>(payload >> 8);
    UbxChecksum sum;
    sum.add(std::span(bytes_).subspan(2, size_ - 2));
    bytes_[size_] = sum.a;
    bytes_[size_ + 1] = sum.b;
    size_ += 2;
    return *this;
  }

  [[nodiscard]] constexpr std::span<const std::uint8_t> bytes() const { return std::span(bytes_).first(size_); }
  [[nodiscard]] constexpr std::uint8_t message_class() const { return bytes_[2]; }
  [[nodiscard]] constexpr std::uint8_t id() const { return bytes_[3]; }

 private:
  std::array<std::uint8_t, kCapacity> bytes_{};
  std::size_t size_ = 0;
};

/// CFG-NAVSPG-DYNMODEL and CFG-NAV5, dynModel: the same numbers.
enum class DynamicModel : std::uint8_t {
  kPortable = 0,
  kStationary = 2,
  kPedestrian = 3,
  kAutomotive = 4,
  kSea = 5,
  kAirborne1g = 6,
  kAirborne2g = 7,
  kAirborne4g = 8
};

/// Configuration keys. The size of a value is in bits 30 to 28: 1 a bit, 2 one byte, 3 two, 4 four.
enum class Key : std::uint32_t {
  kUart1BaudRate = 0x4052'0001,
  kUart1InUbx = 0x1073'0001,
  kUart1OutUbx = 0x1074'0001,
  kUart1OutNmea = 0x1074'0002,
  kRateMeasurement_ms = 0x3021'0001,
  kRateNavigation = 0x3021'0002,
  kDynamicModel = 0x2011'0021,
  kNavPvtUart1 = 0x2091'0007,
  kNavHpPosLlhUart1 = 0x2091'0034,
  kNavCovUart1 = 0x2091'0084,
  kNavRelPosNedUart1 = 0x2091'008E
};

class ValSet {
 public:
  /// Into the layer in RAM alone: what is configured here is forgotten with the power, and flash does not wear.
  constexpr ValSet() { message_.u1(0).u1(kLayerRam).zeros(2); }
  constexpr ValSet& set(Key key, std::uint32_t value) {
    const auto id = static_cast<std::uint32_t>(key);
    message_.u4(id);
    switch (id >> 28 & 7) {
      case 3:
        message_.u2(value);
        break;
      case 4:
        message_.u4(value);
        break;
      default:
        message_.u1(value);
    }
    return *this;
  }
  [[nodiscard]] constexpr Message finish() { return message_.finish(); }

 private:
  static constexpr std::uint32_t kLayerRam = 1;
  Message message_{kClassCfg, 0x8A};
};

[[nodiscard]] constexpr Message poll_version() { return Message(kClassMon, 0x04).finish(); }

/// UART1, 8N1; takes UBX, NMEA and RTCM 2, sends UBX only.
[[nodiscard]] constexpr Message legacy_port(std::uint32_t baud) {
  return Message(kClassCfg, 0x00).u1(1).u1(0).u2(0).u4(0x08D0).u4(baud).u2(0x0007).u2(0x0001).u2(0).u2(0).finish();
}
/// Aligned to GPS time, as the keys of later receivers are.
[[nodiscard]] constexpr Message legacy_rate(std::uint16_t period_ms) {
  return Message(kClassCfg, 0x08).u2(period_ms).u2(1).u2(1).finish();
}
/// A navigation message with every solution, on the port that this arrives at.
[[nodiscard]] constexpr Message legacy_enable(Nav nav) {
  return Message(kClassCfg, 0x01).u1(kClassNav).u1(kNavMessages[static_cast<std::size_t>(nav)].id).u1(1).finish();
}
/// Only the dynamic model: bit 0 of the mask.
[[nodiscard]] constexpr Message legacy_model(DynamicModel model) {
  return Message(kClassCfg, 0x24).u2(0x0001).u1(static_cast<std::uint32_t>(model)).zeros(33).finish();
}

}  // namespace tetap::drivers::gnss::ubx
