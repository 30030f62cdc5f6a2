// SPDX-License-Identifier: Apache-2.0
// Content of the NMEA sentences GGA, RMC, VTG, GSA, GST and ZDA, field by field. NMEA 0183 v4.1, sec. 6.3; u-blox F9
// HPG 1.32 interface description (UBX-22008968), sec. 2.7.
#pragma once

#include "base/math.hpp"
#include "drivers/gnss/nmea/fields.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace tetap::drivers::gnss::nmea {

enum class Sentence : std::uint8_t { kGga, kRmc, kVtg, kGsa, kGst, kZda, kCount };
inline constexpr std::size_t kSentences = static_cast<std::size_t>(Sentence::kCount);
inline constexpr std::array<std::array<std::uint8_t, 3>, kSentences> kFormatters{
    {{'G', 'G', 'A'}, {'R', 'M', 'C'}, {'V', 'T', 'G'}, {'G', 'S', 'A'}, {'G', 'S', 'T'}, {'Z', 'D', 'A'}}};

/// "GPGGA", "GNRMC", ...; sentences of one maker begin with P and are not for us.
[[nodiscard]] constexpr std::optional<Sentence> sentence_of(Text address) {
  if (address.size() != 5 || address[0] == 'P') return {};
  for (std::size_t i = 0; i < kSentences; ++i) {
    const auto& f = kFormatters[i];
    if (address[2] == f[0] && address[3] == f[1] && address[4] == f[2]) return static_cast<Sentence>(i);
  }
  return {};
}

/// Content of an epoch's sentences; NaN, empty or 0: not sent.
struct Parts {
  std::optional<std::int64_t> gga_latitude, gga_longitude, rmc_latitude, rmc_longitude;
  std::optional<std::int32_t> quality, satellites, dimension;
  char rmc_status = '\0', rmc_mode = '\0';
  float altitude_m = base::kNan, separation_m = base::kNan;
  float speed_mps = base::kNan, course_rad = base::kNan, vtg_speed_mps = base::kNan, vtg_course_rad = base::kNan;
  float gga_hdop = base::kNan, pdop = base::kNan, hdop = base::kNan, vdop = base::kNan;
  float horizontal_acc_m = base::kNan, vertical_acc_m = base::kNan;
  bool stamped = false;
};

/// True: the sentence had a time.
constexpr bool parse(Sentence kind, Fields& f, Parts& p, Utc& t) {
  constexpr float kMpsPerKnot = 1852.0F / 3600.0F;
  constexpr float kRadPerDeg = 0.017453293F;
  switch (kind) {
    case Sentence::kGga: {
      p.quality = f.integer(6, 0, 9);
      // Without a fix the place is empty, the last one, or nonsense such as 8960.0000.
      if (p.quality.value_or(0) != 0) {
        p.gga_latitude = f.angle(2, 'N', 'S', 90);
        p.gga_longitude = f.angle(4, 'E', 'W', 180);
        p.altitude_m = f.milli(9);
        p.separation_m = f.milli(11);
      }
      p.satellites = f.integer(7, 0, 255);
      p.gga_hdop = f.milli(8);
      return f.time(1, t);
    }
    case Sentence::kRmc: {
      p.rmc_status = f.letter(2);
      if (p.rmc_status == 'A') {
        p.rmc_latitude = f.angle(3, 'N', 'S', 90);
        p.rmc_longitude = f.angle(5, 'E', 'W', 180);
        p.speed_mps = f.ten_micro(7) * kMpsPerKnot;
        p.course_rad = f.ten_micro(8) * kRadPerDeg;
      }
      if (const auto ddmmyy = f[9].size() == 6 ? f.integer(9, 0, 311'299) : std::nullopt) {
        const int yy = *ddmmyy % 100;
        f.date(*ddmmyy / 10'000, *ddmmyy / 100 % 100, yy + (yy < 80 ? 2000 : 1900), t);
      }
      p.rmc_mode = f.letter(12);
      return f.time(1, t);
    }
    case Sentence::kVtg:
      // Before NMEA 2.0 there were no letters after the numbers.
      if (f.letter(2) == 'T') {
        p.vtg_speed_mps = f.ten_micro(5) * kMpsPerKnot;
        p.vtg_course_rad = f.ten_micro(1) * kRadPerDeg;
      }
      return false;
    case Sentence::kGsa:
      p.dimension = f.integer(2, 0, 3);
      p.pdop = f.milli(15);
      p.hdop = f.milli(16);
      p.vdop = f.milli(17);
      return false;
    case Sentence::kGst: {
      const float lat = f.milli(6), lon = f.milli(7);
      p.horizontal_acc_m = base::sqrt(0.5F * (lat * lat + lon * lon));
      p.vertical_acc_m = f.milli(8);
      return f.time(1, t);
    }
    case Sentence::kZda: {
      const auto day = f.integer(2, 0, 31), month = f.integer(3, 0, 12), year = f.integer(4, 0, 9999);
      if (day && month && year) f.date(*day, *month, *year, t);
      return f.time(1, t);
    }
    case Sentence::kCount:
      break;
  }
  return false;
}

}  // namespace tetap::drivers::gnss::nmea
