// SPDX-License-Identifier: Apache-2.0
// The NMEA sentences GGA, GNS, RMC, VTG, GSA, GST and ZDA, field by field. NMEA 0183 v4.1, sec. 6.3; u-blox F9 HPG
// 1.32 interface description (UBX-22008968), sec. 2.7.
#pragma once

#include "drivers/gnss/nmea/fields.hpp"
#include "tetap/base/math.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace tetap::drivers::gnss::nmea {

enum class Sentence : std::uint8_t { kGga, kRmc, kVtg, kGsa, kGst, kZda, kGns, kCount };
inline constexpr std::size_t kSentences = static_cast<std::size_t>(Sentence::kCount);
inline constexpr std::array<std::array<std::uint8_t, 3>, kSentences> kFormatters{{{'G', 'G', 'A'},
                                                                                  {'R', 'M', 'C'},
                                                                                  {'V', 'T', 'G'},
                                                                                  {'G', 'S', 'A'},
                                                                                  {'G', 'S', 'T'},
                                                                                  {'Z', 'D', 'A'},
                                                                                  {'G', 'N', 'S'}}};

/// "GPGGA", "GNRMC", ...; sentences of one maker begin with P and are not for us.
[[nodiscard]] constexpr std::optional<Sentence> sentence_of(Text address) {
  if (address.size() != 5 || address[0] == 'P') return {};
  for (std::size_t i = 0; i < kSentences; ++i) {
    const auto& f = kFormatters[i];
    if (address[2] == f[0] && address[3] == f[1] && address[4] == f[2]) return static_cast<Sentence>(i);
  }
  return {};
}

/// Kind of solution, from the worst to the best.
enum class Solution : std::uint8_t {
  kNone,
  kNotMeasured,  ///< dead reckoning, typed in or simulated: no satellite measured it
  kAutonomous,
  kDifferential,
  kRtkFloat,
  kRtkFixed
};
/// GGA field 6: NMEA 0183 v4.1 sec. 6.3 for 0 to 8, NovAtel OEM7 (log GPGGA) for 9. 3 is the precise service (PPS).
/// docs/reference/receivers.md has the manuals figure by figure.
inline constexpr std::array<Solution, 10> kQualities{
    Solution::kNone,        Solution::kAutonomous,  Solution::kDifferential, Solution::kAutonomous,
    Solution::kRtkFixed,    Solution::kRtkFloat,    Solution::kNotMeasured,  Solution::kNotMeasured,
    Solution::kNotMeasured, Solution::kDifferential};
/// The letters of the mode indicator in RMC and GNS; empty: no such letter.
[[nodiscard]] constexpr std::optional<Solution> solution_of_mode(char mode) {
  switch (mode) {
    case 'N':
      return Solution::kNone;
    case 'E':
    case 'M':
    case 'S':
      return Solution::kNotMeasured;
    case 'A':
    case 'P':
      return Solution::kAutonomous;
    case 'D':
      return Solution::kDifferential;
    case 'F':
      return Solution::kRtkFloat;
    case 'R':
      return Solution::kRtkFixed;
    default:
      return {};
  }
}

/// Contents of the sentences of an epoch.
struct Parts {
  std::optional<std::int64_t> gga_latitude, gga_longitude, gns_latitude, gns_longitude, rmc_latitude, rmc_longitude;
  std::optional<std::int32_t> quality, satellites, gns_satellites, dimension;
  std::optional<Solution> gns_solution;
  char rmc_status = '\0', rmc_mode = '\0';
  float altitude_m = base::kNan, separation_m = base::kNan;
  float gns_altitude_m = base::kNan, gns_separation_m = base::kNan, gns_hdop = base::kNan;
  float speed_mps = base::kNan, course_rad = base::kNan, vtg_speed_mps = base::kNan, vtg_course_rad = base::kNan;
  float gga_hdop = base::kNan, pdop = base::kNan, hdop = base::kNan, vdop = base::kNan;
  float horizontal_acc_m = base::kNan, vertical_acc_m = base::kNan;
  std::uint16_t gsa_of_best_mode = 0;  ///< GSA sentences with the fix mode of `dimension`
  std::uint16_t gsa_unused = 0;        ///< GSA sentences with a lesser one
  bool stamped = false;
};

/// A receiver of several constellations sends one GSA for each: 1 in one of them means that this one is not used. The
/// best mode is the epoch's; the dilution of precision belongs to it.
constexpr void parse_gsa(Fields& f, Parts& p) {
  const auto mode = f.natural(2, 3);
  if (mode && *mode < 1) return f.refuse();
  const float pdop = f.milli(15), hdop = f.milli(16), vdop = f.milli(17);
  if (mode && p.dimension && *mode < *p.dimension) {
    ++p.gsa_unused;
    return;
  }
  if (mode && p.dimension && *mode > *p.dimension) {
    p.gsa_unused = static_cast<std::uint16_t>(p.gsa_unused + p.gsa_of_best_mode);
    p.gsa_of_best_mode = 0;
  }
  if (mode) {
    p.dimension = mode;
    ++p.gsa_of_best_mode;
  }
  p.pdop = pdop;
  p.hdop = hdop;
  p.vdop = vdop;
}

/// Field 6 has a letter for each constellation; the best one is the fix. With the place empty the sentence adds the age
/// of corrections of one constellation to the place of another sentence.
constexpr void parse_gns(Fields& f, Parts& p) {
  std::optional<Solution> best;
  for (const std::uint8_t letter : f[6]) {
    const auto solution = solution_of_mode(static_cast<char>(letter));
    if (!solution) return f.refuse();
    if (!best || *solution > *best) best = solution;
  }
  if (!best) return;
  p.gns_solution = best;
  if (*best != Solution::kNone) {
    p.gns_latitude = f.angle(2, 'N', 'S', 90);
    p.gns_longitude = f.angle(4, 'E', 'W', 180);
    p.gns_altitude_m = f.milli(9);
    p.gns_separation_m = f.milli(10);
  }
  p.gns_satellites = f.natural(7, 255);
  p.gns_hdop = f.milli(8);
}

/// True: the sentence had a time.
constexpr bool parse(Sentence kind, Fields& f, Parts& p, Utc& t) {
  constexpr float kMpsPerKnot = 1852.0F / 3600.0F;
  constexpr float kRadPerDeg = 0.017453293F;
  switch (kind) {
    case Sentence::kGga: {
      p.quality = f.natural(6, 9);
      // Without a fix the place is empty, the last one, or nonsense such as 8960.0000.
      if (p.quality.value_or(0) != 0) {
        p.gga_latitude = f.angle(2, 'N', 'S', 90);
        p.gga_longitude = f.angle(4, 'E', 'W', 180);
        p.altitude_m = f.milli(9);
        p.separation_m = f.milli(11);
      }
      p.satellites = f.natural(7, 255);
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
      parse_gsa(f, p);
      return false;
    case Sentence::kGns:
      parse_gns(f, p);
      return f.time(1, t);
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
