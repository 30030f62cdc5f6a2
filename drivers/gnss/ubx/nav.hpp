// SPDX-License-Identifier: Apache-2.0
// Payloads of the UBX navigation messages, field by field. Sources: u-blox F9 HPG 1.32 interface description
// (UBX-22008968), sec. 3.15: UBX-NAV-PVT, -COV, -POSLLH, -HPPOSLLH, -RELPOSNED, -VELNED, -STATUS, -DOP, -TIMEUTC,
// -TIMEGPS, -POSECEF, -VELECEF, -EOE; u-blox 8 / M8 protocol specification (UBX-13003221), sec. 32.17: UBX-NAV-SOL.
#pragma once

#include "drivers/gnss/calendar.hpp"
#include "drivers/gnss/report.hpp"

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>

namespace tetap::drivers::gnss::ubx {

inline constexpr std::uint8_t kClassNav = 0x01, kClassAck = 0x05, kClassCfg = 0x06, kClassMon = 0x0A;

enum class Nav : std::uint8_t {
  kPosEcef,
  kPosLlh,
  kStatus,
  kDop,
  kSol,
  kPvt,
  kVelEcef,
  kVelNed,
  kHpPosLlh,
  kTimeGps,
  kTimeUtc,
  kCov,
  kRelPosNed,
  kEndOfEpoch,
  kCount
};
inline constexpr std::size_t kNavKinds = static_cast<std::size_t>(Nav::kCount);

struct NavMessage {
  std::uint8_t id;
  std::uint8_t length;
  std::uint8_t itow_at = 0;  ///< offset of the time of week
};
/// In the order of Nav. NAV-PVT was 84 bytes long before protocol 15 (M7).
inline constexpr std::array<NavMessage, kNavKinds> kNavMessages{{{0x01, 20},
                                                                 {0x02, 28},
                                                                 {0x03, 16},
                                                                 {0x04, 18},
                                                                 {0x06, 52},
                                                                 {0x07, 92},
                                                                 {0x11, 20},
                                                                 {0x12, 36},
                                                                 {0x14, 36, 4},
                                                                 {0x20, 16},
                                                                 {0x21, 20},
                                                                 {0x36, 64},
                                                                 {0x3C, 64, 4},
                                                                 {0x61, 4}}};
inline constexpr std::size_t kOldPvtLength = 84;
inline constexpr std::size_t kOldRelPosNedLength = 40;  ///< version 0, of the M8P: no heading, no length

/// Little-endian fields; the caller has checked the length.
struct Fields {
  std::span<const std::uint8_t> bytes;
  [[nodiscard]] constexpr std::uint8_t u1(std::size_t at) const { return bytes[at]; }
  [[nodiscard]] constexpr std::uint16_t u2(std::size_t at) const {
    return static_cast<std::uint16_t>(bytes[at] | bytes[at + 1] << 8);
  }
  [[nodiscard]] constexpr std::uint32_t u4(std::size_t at) const {
    return std::uint32_t{u2(at)} | std::uint32_t{u2(at + 2)} << 16;
  }
  [[nodiscard]] constexpr std::int8_t i1(std::size_t at) const { return static_cast<std::int8_t>(bytes[at]); }
  [[nodiscard]] constexpr std::int16_t i2(std::size_t at) const { return static_cast<std::int16_t>(u2(at)); }
  [[nodiscard]] constexpr std::int32_t i4(std::size_t at) const { return static_cast<std::int32_t>(u4(at)); }
  [[nodiscard]] constexpr float r4(std::size_t at) const { return std::bit_cast<float>(u4(at)); }
  /// With the integer's units per unit, divided because 1e-3 is no float: signed, unsigned of four bytes, of two.
  [[nodiscard]] constexpr float si4(std::size_t at, float per) const { return static_cast<float>(i4(at)) / per; }
  [[nodiscard]] constexpr float su4(std::size_t at, float per) const { return static_cast<float>(u4(at)) / per; }
  [[nodiscard]] constexpr float su2(std::size_t at, float per) const { return static_cast<float>(u2(at)) / per; }
};

inline constexpr float kMilli = 1000, kCenti = 100, kTenthMilli = 10'000;
inline constexpr float k1e5degPerRad = 5.7295780e6F;

/// gpsFix and fixType are the same scale: 0 none, 1 dead reckoning only, 2 2D, 3 3D, 4 GNSS and dead reckoning, 5 time.
/// Dead reckoning alone is no fix: its errors are those of sensors that the robot's own filter fuses better.
[[nodiscard]] constexpr sensor::GnssFix fix_of(std::uint8_t type, bool ok, bool differential, std::uint8_t carrier) {
  using sensor::GnssFix;
  if (type == 5) return GnssFix::kTimeOnly;
  if (!ok || type < 2 || type > 4) return GnssFix::kNone;
  if (carrier == 2) return GnssFix::kRtkFixed;
  if (carrier == 1) return GnssFix::kRtkFloat;
  if (type == 2) return GnssFix::k2d;
  return differential ? GnssFix::kDifferential : GnssFix::k3d;
}

/// False: not on Earth. Rounded half away from zero to the units of the report.
[[nodiscard]] constexpr bool set_angles_ndeg(std::int64_t latitude_ndeg, std::int64_t longitude_ndeg, Report& out) {
  constexpr std::int64_t kPole = 90'000'000'000, kDateLine = 180'000'000'000;
  if (latitude_ndeg > kPole || latitude_ndeg < -kPole || longitude_ndeg > kDateLine || longitude_ndeg < -kDateLine)
    return false;
  const auto half = [](std::int64_t x) { return (x + (x < 0 ? -1 : 1)) / 2; };
  out.latitude_2ndeg = half(latitude_ndeg);
  out.longitude_2ndeg = half(longitude_ndeg);
  out.has_position = true;
  return true;
}
[[nodiscard]] constexpr bool set_angles(std::int32_t latitude_1e7deg, std::int32_t longitude_1e7deg, Report& out) {
  return set_angles_ndeg(std::int64_t{latitude_1e7deg} * 100, std::int64_t{longitude_1e7deg} * 100, out);
}

/// The parts that NAV-HPPOSLLH and NAV-RELPOSNED add to a coarser field are within +-99 hundredths of its unit, heights
/// of NAV-HPPOSLLH within +-9 tenths.
[[nodiscard]] constexpr bool fine_part(std::int8_t part, int most) { return part >= -most && part <= most; }

/// Year, month, day, hour, minute, second from offset `at` on. False: marked as valid, but no such date or time.
[[nodiscard]] constexpr bool set_utc(const Fields& f, std::size_t at, bool date, bool time, std::int32_t nano,
                                     Utc& out) {
  const bool is_day = is_date(f.u2(at), f.u1(at + 2), f.u1(at + 3));
  const bool is_hour =
      is_time(f.u1(at + 4), f.u1(at + 5), f.u1(at + 6)) && nano >= -1'000'000'000 && nano <= 1'000'000'000;
  out = {.year = f.u2(at),
         .month = f.u1(at + 2),
         .day = f.u1(at + 3),
         .hour = f.u1(at + 4),
         .minute = f.u1(at + 5),
         .second = f.u1(at + 6),
         .nano = nano,
         .date_valid = date && is_day,
         .time_valid = time && is_hour};
  return (!date || is_day) && (!time || is_hour);
}

constexpr void set_velocity_ned(float north, float east, float down, Report& out) {
  out.v_n_mps = {east, north, -down};
}

/// NAV-COV gives the upper triangle in north, east, down; here east, north, up.
[[nodiscard]] constexpr std::optional<Covariance> covariance_enu(const Fields& f, std::size_t at) {
  const float nn = f.r4(at), ne = f.r4(at + 4), nd = f.r4(at + 8), ee = f.r4(at + 12), ed = f.r4(at + 16);
  const float dd = f.r4(at + 20);
  for (const float x : {nn, ne, nd, ee, ed, dd})
    if (!base::is_finite(x)) return {};
  if (!(nn > 0 && ee > 0 && dd > 0)) return {};
  return Covariance{ee, ne, -ed, nn, -nd, dd};
}

}  // namespace tetap::drivers::gnss::ubx
