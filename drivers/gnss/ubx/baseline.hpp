// SPDX-License-Identifier: Apache-2.0
// UBX-NAV-RELPOSNED, the line between two antennas, as a heading: u-blox F9 HPG 1.32 interface description
// (UBX-22008968), sec. 3.15, version 1; u-blox 8 / M8 protocol specification (UBX-13003221), sec. 32.17, version 0.
#pragma once

#include "drivers/gnss/health.hpp"
#include "drivers/gnss/ubx/nav.hpp"
#include "tetap/base/math.hpp"

#include <cstdint>
#include <optional>
#include <span>

namespace tetap::drivers::gnss::ubx {

/// Flags of a line that is a heading: fix, relative position valid, ambiguities fixed (carrSoln 2), the reference
/// antenna moves with the robot, nothing extrapolated. Without a moving reference the line ends at a station on the
/// ground. ArduPilot's driver (AP_GPS_UBLOX, RELPOSNED) asks for the same bits.
inline constexpr std::uint32_t kRelPosRequested = 0x00FD, kRelPosRequired = 0x0035;
inline constexpr std::uint32_t kRelPosHeadingValid = 0x0100, kRelPosNormalised = 0x0200;

/// North, east, down or length: centimetres, and hundredths of them in a byte.
[[nodiscard]] constexpr float centimetres(const Fields& f, std::size_t at, std::size_t part) {
  return static_cast<float>(static_cast<double>(std::int64_t{f.i4(at)} * 100 + f.i1(part)) / 10'000.0);
}

/// Version 0 has no heading: it follows from the line's ends, of which each axis has its own accuracy.
constexpr void course_of_ends(float east_acc_m, float north_acc_m, Baseline& b) {
  const float east = b.n_m[0], north = b.n_m[1], square = east * east + north * north;
  if (!(square > 0)) return;
  const float across_east = north * east_acc_m, across_north = east * north_acc_m;
  b.length_m = base::sqrt(square + b.n_m[2] * b.n_m[2]);
  b.length_acc_m = base::max(east_acc_m, north_acc_m);
  b.course_rad = base::atan2(east, north);
  b.course_acc_rad = base::sqrt(across_east * across_east + across_north * across_north) / square;
}

/// Whether the length is that of the antennas on the robot. A wrong integer ambiguity changes it by a part of 19 cm,
/// the wavelength of L1. The 5 cm are for the tape; `mounted_m` 0: not checked.
[[nodiscard]] constexpr bool has_length(const Baseline& b, float mounted_m) {
  constexpr float kTape_m = 0.05F;
  if (!(mounted_m > 0) || base::is_nan(b.length_m)) return true;
  return base::abs(b.length_m - mounted_m) <= kTape_m + 3.0F * b.length_acc_m;
}

[[nodiscard]] constexpr bool fine_parts(const Fields& f, std::size_t at, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i)
    if (!fine_part(f.i1(at + i), 99)) return false;
  return true;
}

/// Empty: not such a message; the reason is counted. A line that is no heading is counted, too, and not valid.
[[nodiscard]] constexpr std::optional<Baseline> baseline(std::span<const std::uint8_t> payload, float mounted_m,
                                                         Health& health) {
  const bool old = payload.size() == kOldRelPosNedLength;
  if (!old && payload.size() != kNavMessages[static_cast<std::size_t>(Nav::kRelPosNed)].length)
    return health.add(Reason::kUbxLength), std::nullopt;
  const Fields f{payload};
  if (f.u1(0) != (old ? 0 : 1)) return health.add(Reason::kUbxVersion), std::nullopt;
  const std::size_t parts = old ? 20 : 32, accuracies = old ? 24 : 36;
  if (!fine_parts(f, parts, old ? 3 : 4)) return health.add(Reason::kOutOfRange), std::nullopt;
  const std::uint32_t flags = f.u4(old ? 36 : 60);
  Baseline b{.itow_ms = f.u4(4)};
  const bool normalised = !old && (flags & kRelPosNormalised) != 0;
  if (!normalised) b.n_m = {centimetres(f, 12, parts + 1), centimetres(f, 8, parts), -centimetres(f, 16, parts + 2)};
  if (old) {
    course_of_ends(f.su4(accuracies + 4, kTenthMilli), f.su4(accuracies, kTenthMilli), b);
  } else {
    constexpr std::int32_t kTurn_1e5deg = 36'000'000;
    if (f.i4(24) > kTurn_1e5deg || f.i4(24) < -kTurn_1e5deg) return health.add(Reason::kOutOfRange), std::nullopt;
    if (!normalised) {
      b.length_m = centimetres(f, 20, parts + 3);
      b.length_acc_m = f.su4(accuracies + 12, kTenthMilli);
    }
    b.course_rad = f.si4(24, k1e5degPerRad);
    // An accuracy of 0 is none.
    if (f.u4(52) != 0) b.course_acc_rad = f.su4(52, k1e5degPerRad);
  }
  const bool heading = (flags & kRelPosRequested) == kRelPosRequired && (old || (flags & kRelPosHeadingValid) != 0);
  b.valid = heading && !base::is_nan(b.course_rad) && has_length(b, mounted_m);
  if (!b.valid) health.add(Reason::kBaseline);
  return b;
}

}  // namespace tetap::drivers::gnss::ubx
