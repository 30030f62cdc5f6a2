// SPDX-License-Identifier: Apache-2.0
// UBX-NAV-DAHEADING, the heading of a receiver with two antennas (ZED-X20D), version 2: u-blox X20 HDG 2.00 interface
// description (UBXDOC-304424225-21470). Version 1, of firmware before HDG 2.00, has another layout and is refused.
#pragma once

#include "drivers/gnss/health.hpp"
#include "drivers/gnss/ubx/baseline.hpp"

#include <cstdint>
#include <optional>
#include <span>

namespace tetap::drivers::gnss::ubx {

inline constexpr std::uint8_t kDualAntennaId = 0x45;
inline constexpr std::size_t kDualAntennaLength = 60;
/// Flags of a heading: fix, relative position valid, ambiguities fixed (carrSoln 2), heading valid.
inline constexpr std::uint32_t kDualAntennaFlags = 0x005D, kDualAntennaRequired = 0x0055;

/// Empty: not such a message; the reason is counted. A line that is no heading is counted, too, and not valid. The
/// receiver adds CFG-NAVSPG-DAHEADING_OFFSET to the heading alone; `mounted_m` 0: the length is not checked.
[[nodiscard]] constexpr std::optional<Baseline> dual_antenna(std::span<const std::uint8_t> payload, float mounted_m,
                                                             Health& health) {
  constexpr std::int32_t kTurn_1e5deg = 36'000'000;
  if (payload.empty() || payload[0] != 2) return health.add(Reason::kUbxVersion), std::nullopt;
  if (payload.size() != kDualAntennaLength) return health.add(Reason::kUbxLength), std::nullopt;
  const Fields f{payload};
  if (f.i4(24) > kTurn_1e5deg || f.i4(24) < -kTurn_1e5deg) return health.add(Reason::kOutOfRange), std::nullopt;
  Baseline b{.itow_ms = f.u4(4)};
  b.n_m = {f.si4(12, kMilli), f.si4(8, kMilli), -f.si4(16, kMilli)};
  b.length_m = f.si4(20, kMilli);
  b.length_acc_m = f.su4(44, kMilli);
  b.course_rad = f.si4(24, k1e5degPerRad);
  // An accuracy of 0 is none.
  if (f.u4(48) != 0) b.course_acc_rad = f.su4(48, k1e5degPerRad);
  b.valid = (f.u4(56) & kDualAntennaFlags) == kDualAntennaRequired && has_length(b, mounted_m);
  if (!b.valid) health.add(Reason::kBaseline);
  return b;
}

}  // namespace tetap::drivers::gnss::ubx
