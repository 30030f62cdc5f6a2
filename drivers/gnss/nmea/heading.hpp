// SPDX-License-Identifier: Apache-2.0
// The NMEA sentences HDT and THS as a heading of two antennas: degrees clockwise from true north, no accuracy, no time.
// NMEA 0183 v4.1, sec. 6.3: THS replaces HDT and has a mode, of which only A (autonomous) is measured.
#pragma once

#include "drivers/gnss/health.hpp"
#include "drivers/gnss/nmea/fields.hpp"
#include "drivers/gnss/report.hpp"

#include <cstdint>
#include <optional>

namespace tetap::drivers::gnss::nmea {

enum class HeadingKind : std::uint8_t { kHdt, kThs };

/// "GPHDT", "GNTHS", ... of any talker but a maker's own.
[[nodiscard]] constexpr std::optional<HeadingKind> heading_kind(Text address) {
  if (address.size() != 5 || address[0] == 'P') return {};
  if (address[2] == 'H' && address[3] == 'D' && address[4] == 'T') return HeadingKind::kHdt;
  if (address[2] == 'T' && address[3] == 'H' && address[4] == 'S') return HeadingKind::kThs;
  return {};
}

/// Empty: a field that is not what it should be; it is counted. An empty angle, and another mode than A, are counted,
/// too, and not valid.
[[nodiscard]] constexpr std::optional<Baseline> heading(Fields& f, HeadingKind kind, Health& health) {
  constexpr std::int32_t kTurn_mdeg = 360'000;
  constexpr float kMdegPerRad = 57'295.780F;
  const auto angle_mdeg = f.integer(1, 3, kTurn_mdeg);
  const char mark = f.letter(2);
  const bool hdt = kind == HeadingKind::kHdt;
  const bool known = hdt ? mark == 'T' : mark == 'A' || mark == 'E' || mark == 'M' || mark == 'S' || mark == 'V';
  const bool empty = !angle_mdeg && mark == '\0';
  if ((!known && !empty) || (angle_mdeg && *angle_mdeg < 0)) f.refuse();
  if (!f.ok()) return health.add(Reason::kNmeaField), std::nullopt;
  Baseline b{};
  if (angle_mdeg) b.course_rad = static_cast<float>(*angle_mdeg) / kMdegPerRad;
  b.valid = angle_mdeg && (hdt || mark == 'A');
  if (!b.valid) health.add(Reason::kBaseline);
  return b;
}

/// One heading of those that arrive side by side: UBX before THS before HDT, which is the same one without a mode.
class HeadingChoice {
 public:
  constexpr void on_ubx() { hdt_held_back_ = ths_held_back_ = kToWait; }
  /// False: another sentence or protocol has this heading, too.
  [[nodiscard]] constexpr bool takes(HeadingKind kind) {
    auto& held_back = kind == HeadingKind::kHdt ? hdt_held_back_ : ths_held_back_;
    if (held_back > 0) {
      --held_back;
      return false;
    }
    if (kind == HeadingKind::kThs) hdt_held_back_ = kToWait;
    return true;
  }

 private:
  static constexpr std::uint8_t kToWait = 3;  ///< headings, as NMEA epochs wait beside UBX
  std::uint8_t hdt_held_back_ = 0, ths_held_back_ = 0;
};

}  // namespace tetap::drivers::gnss::nmea
