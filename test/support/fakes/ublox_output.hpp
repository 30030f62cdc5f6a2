// SPDX-License-Identifier: Apache-2.0
// What a u-blox receiver says of a solution, message by message, byte by byte, from the manuals: ZED-F9P interface
// description (UBX-18010854 R04; "sec." alone is of it), u-blox F9 HPG 1.32 interface description (UBX-22008968) for
// NAV-COV, u-blox 8 / M8 protocol specification (UBX-13003221) for NAV-SOL. Knows no driver.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

namespace tetap::fakes::ublox {

using Bytes = std::vector<std::uint8_t>;

/// kLimits: a fix beyond the user's masks of DOP and accuracy, so not valid (sec. 5.14.11 gnssFixOK, sec. 4.1.6).
enum class Fix : std::uint8_t { kNone, kLimits, k2d, k3d, kDifferential, kRtkFloat, kRtkFixed };

/// Upper triangle in the order EE, EN, EU, NN, NU, UU.
using Covariance = std::array<double, 6>;

/// What the receiver found out at one epoch, in SI and east, north, up.
struct Solution {
  Fix fix = Fix::k3d;
  int satellites = 17;
  double latitude_deg = 47.285233, longitude_deg = 8.565265;
  double height_m = 546.6, msl_m = 499.6;  ///< above the ellipsoid, above mean sea level
  std::array<double, 3> v_mps{};
  double horizontal_acc_m = 1.234, vertical_acc_m = 2.345, speed_acc_mps = 0.321, course_acc_deg = 0.45;
  double pdop = 1.94, hdop = 1.18, vdop = 1.54;
  Covariance position_cov_m2{0.25, 0.05, -0.02, 2.25, 0.03, 1.21};
  Covariance velocity_cov_m2ps2{0.01, 0.002, -0.001, 0.0225, 0.003, 0.04};

  [[nodiscard]] double speed_mps() const { return std::hypot(v_mps[0], v_mps[1]); }
  /// Clockwise from north, 0 to 360.
  [[nodiscard]] double course_deg() const {
    const double course = std::atan2(v_mps[0], v_mps[1]) * 180 / M_PI;
    return course < 0 ? course + 360 : course;
  }
};

/// When it was: GPS week, milliseconds of it, and what the epoch truly lies beside them.
struct Instant {
  int week = 2306;
  std::uint32_t itow_ms = 0;
  std::int32_t beside_ns = 0;
  int leap_s = 18;

  struct Utc {
    int year, month, day, hour, minute, second;
    std::int64_t nano;
  };
  /// Rounded to the nearest `grid_ns`, so that `nano` beyond the whole second may be negative (sec. 5.14.11, nano).
  [[nodiscard]] Utc utc(std::int64_t grid_ns) const {
    using namespace std::chrono;
    const sys_days week_0 = sys_days{year{1980} / 1 / 6};  // IS-GPS-200, sec. 3.3.4
    const std::int64_t seconds_ns = (std::int64_t{itow_ms} - 1000 * std::int64_t{leap_s}) * 1'000'000;
    const std::int64_t exact_ns = seconds_ns + beside_ns;
    const std::int64_t rounded_ns = (exact_ns + grid_ns / 2 + (exact_ns < 0 ? 1 - grid_ns : 0)) / grid_ns * grid_ns;
    const std::int64_t second = (rounded_ns - (rounded_ns < 0 ? 999'999'999 : 0)) / 1'000'000'000;
    const sys_seconds whole = week_0 + weeks{week} + seconds{second};
    const sys_days day = floor<days>(whole);
    const year_month_day date{day};
    const hh_mm_ss time{whole - day};
    return {.year = int{date.year()},
            .month = static_cast<int>(unsigned{date.month()}),
            .day = static_cast<int>(unsigned{date.day()}),
            .hour = static_cast<int>(time.hours().count()),
            .minute = static_cast<int>(time.minutes().count()),
            .second = static_cast<int>(time.seconds().count()),
            .nano = exact_ns - second * 1'000'000'000};
  }
};

// ---- UBX

/// Sec. 5.2: preamble, class, ID, little-endian length of the payload; sec. 5.4: 8-bit Fletcher over class to payload.
inline Bytes frame(std::uint8_t message_class, std::uint8_t id, const Bytes& payload) {
  Bytes out{0xB5,
            0x62,
            message_class,
            id,
            static_cast<std::uint8_t>(payload.size()),
            static_cast<std::uint8_t>(payload.size() >> 8)};
  out.insert(out.end(), payload.begin(), payload.end());
  unsigned a = 0, b = 0;
  for (std::size_t i = 2; i < out.size(); ++i) b += a += out[i];
  out.push_back(static_cast<std::uint8_t>(a));
  out.push_back(static_cast<std::uint8_t>(b));
  return out;
}

/// A payload written by offset, little-endian (sec. 5.3).
class Payload {
 public:
  explicit Payload(std::size_t size) : bytes_(size, 0) {}
  Payload& put(std::size_t at, std::size_t size, std::int64_t value) {
    for (std::size_t i = 0; i < size; ++i) bytes_.at(at + i) = static_cast<std::uint8_t>(value >> (8 * i));
    return *this;
  }
  /// In units of 1/`per`.
  Payload& scaled(std::size_t at, std::size_t size, double value, double per) {
    return put(at, size, std::llround(value * per));
  }
  Payload& r4(std::size_t at, double value) {
    return put(at, 4, std::bit_cast<std::uint32_t>(static_cast<float>(value)));
  }
  /// year, month, day, hour, min, sec: seven bytes, the same in NAV-PVT and NAV-TIMEUTC.
  Payload& calendar(std::size_t at, const Instant::Utc& utc) {
    put(at, 2, utc.year).put(at + 2, 1, utc.month).put(at + 3, 1, utc.day);
    return put(at + 4, 1, utc.hour).put(at + 5, 1, utc.minute).put(at + 6, 1, utc.second);
  }
  [[nodiscard]] const Bytes& bytes() const { return bytes_; }

 private:
  Bytes bytes_;
};

inline constexpr std::uint8_t kNav = 0x01;
inline constexpr std::uint8_t kNavPosLlh = 0x02, kNavDop = 0x04, kNavSol = 0x06, kNavPvt = 0x07, kNavVelNed = 0x12,
                              kNavTimeUtc = 0x21, kNavCov = 0x36;

/// gpsFix, fixType: 0 none, 2 2D, 3 3D.
inline int fix_type(Fix fix) { return fix == Fix::kNone ? 0 : fix == Fix::k2d ? 2 : 3; }
inline bool fix_ok(Fix fix) { return fix >= Fix::k2d; }
inline bool differential(Fix fix) { return fix >= Fix::kDifferential; }

/// Sec. 5.14.11.
inline Bytes nav_pvt(const Solution& s, const Instant& t) {
  const auto utc = t.utc(10'000'000);
  const int carrier = s.fix == Fix::kRtkFixed ? 2 : s.fix == Fix::kRtkFloat ? 1 : 0;  // carrSoln, bits 7 and 6
  return Payload(92)
      .put(0, 4, t.itow_ms)
      .calendar(4, utc)
      .put(11, 1, 0x07)  // validDate, validTime, fullyResolved
      .put(12, 4, 25)
      .put(16, 4, utc.nano)
      .put(20, 1, fix_type(s.fix))
      .put(21, 1, (fix_ok(s.fix) ? 1 : 0) | (differential(s.fix) ? 2 : 0) | carrier << 6)
      .put(23, 1, s.satellites)
      .scaled(24, 4, s.longitude_deg, 1e7)
      .scaled(28, 4, s.latitude_deg, 1e7)
      .scaled(32, 4, s.height_m, 1e3)
      .scaled(36, 4, s.msl_m, 1e3)
      .scaled(40, 4, s.horizontal_acc_m, 1e3)
      .scaled(44, 4, s.vertical_acc_m, 1e3)
      .scaled(48, 4, s.v_mps[1], 1e3)
      .scaled(52, 4, s.v_mps[0], 1e3)
      .scaled(56, 4, -s.v_mps[2], 1e3)
      .scaled(60, 4, s.speed_mps(), 1e3)
      .scaled(64, 4, s.course_deg(), 1e5)
      .scaled(68, 4, s.speed_acc_mps, 1e3)
      .scaled(72, 4, s.course_acc_deg, 1e5)
      .scaled(76, 2, s.pdop, 1e2)
      .put(78, 2, s.fix == Fix::kNone ? 1 : 0)  // flags3, invalidLlh (UBX-22008968, sec. 3.15)
      .bytes();
}

/// UBX-22008968, sec. 3.15, UBX-NAV-COV: NN, NE, ND, EE, ED, DD of position, then of velocity.
inline Bytes nav_cov(const Solution& s, const Instant& t) {
  Payload p(64);
  p.put(0, 4, t.itow_ms).put(5, 1, fix_ok(s.fix)).put(6, 1, fix_ok(s.fix));
  const auto triangle = [&](std::size_t at, const Covariance& c) {
    p.r4(at, c[3]).r4(at + 4, c[1]).r4(at + 8, -c[4]).r4(at + 12, c[0]).r4(at + 16, -c[2]).r4(at + 20, c[5]);
  };
  triangle(16, s.position_cov_m2);
  triangle(40, s.velocity_cov_m2ps2);
  return p.bytes();
}

/// Sec. 5.14.10.
inline Bytes nav_posllh(const Solution& s, const Instant& t) {
  return Payload(28)
      .put(0, 4, t.itow_ms)
      .scaled(4, 4, s.longitude_deg, 1e7)
      .scaled(8, 4, s.latitude_deg, 1e7)
      .scaled(12, 4, s.height_m, 1e3)
      .scaled(16, 4, s.msl_m, 1e3)
      .scaled(20, 4, s.horizontal_acc_m, 1e3)
      .scaled(24, 4, s.vertical_acc_m, 1e3)
      .bytes();
}

/// Sec. 5.14.2.
inline Bytes nav_dop(const Solution& s, const Instant& t) {
  return Payload(18)
      .put(0, 4, t.itow_ms)
      .scaled(4, 2, 1.1 * s.pdop, 1e2)
      .scaled(6, 2, s.pdop, 1e2)
      .scaled(8, 2, 0.9 * s.pdop, 1e2)
      .scaled(10, 2, s.vdop, 1e2)
      .scaled(12, 2, s.hdop, 1e2)
      .scaled(14, 2, 0.8 * s.hdop, 1e2)
      .scaled(16, 2, 0.7 * s.hdop, 1e2)
      .bytes();
}

/// Sec. 5.14, UBX-NAV-VELNED: cm/s.
inline Bytes nav_velned(const Solution& s, const Instant& t) {
  return Payload(36)
      .put(0, 4, t.itow_ms)
      .scaled(4, 4, s.v_mps[1], 1e2)
      .scaled(8, 4, s.v_mps[0], 1e2)
      .scaled(12, 4, -s.v_mps[2], 1e2)
      .scaled(16, 4, std::hypot(s.speed_mps(), s.v_mps[2]), 1e2)
      .scaled(20, 4, s.speed_mps(), 1e2)
      .scaled(24, 4, s.course_deg(), 1e5)
      .scaled(28, 4, s.speed_acc_mps, 1e2)
      .scaled(32, 4, s.course_acc_deg, 1e5)
      .bytes();
}

/// Sec. 5.14, UBX-NAV-TIMEUTC.
inline Bytes nav_timeutc(const Solution&, const Instant& t) {
  const auto utc = t.utc(10'000'000);
  return Payload(20)
      .put(0, 4, t.itow_ms)
      .put(4, 4, 25)
      .put(8, 4, utc.nano)
      .calendar(12, utc)
      .put(19, 1, 0x07)  // validTOW, validWKN, validUTC
      .bytes();
}

/// UBX-13003221, sec. 32.17, UBX-NAV-SOL: Earth-centred, cm and cm/s (WGS84: NIMA TR8350.2, table 3.1).
inline Bytes nav_sol(const Solution& s, const Instant& t) {
  const double a = 6378137.0, f = 1 / 298.257223563, e2 = f * (2 - f);
  const double b = s.latitude_deg * M_PI / 180, l = s.longitude_deg * M_PI / 180;
  const double n = a / std::sqrt(1 - e2 * std::sin(b) * std::sin(b));
  const double outward = -s.v_mps[1] * std::sin(b) + s.v_mps[2] * std::cos(b);
  return Payload(52)
      .put(0, 4, t.itow_ms)
      .put(4, 4, t.beside_ns)
      .put(8, 2, t.week)
      .put(10, 1, fix_type(s.fix))
      .put(11, 1, (fix_ok(s.fix) ? 1 : 0) | (differential(s.fix) ? 2 : 0) | 0x0C)
      .scaled(12, 4, (n + s.height_m) * std::cos(b) * std::cos(l), 1e2)
      .scaled(16, 4, (n + s.height_m) * std::cos(b) * std::sin(l), 1e2)
      .scaled(20, 4, (n * (1 - e2) + s.height_m) * std::sin(b), 1e2)
      .scaled(24, 4, std::hypot(s.horizontal_acc_m, s.vertical_acc_m), 1e2)
      .scaled(28, 4, outward * std::cos(l) - s.v_mps[0] * std::sin(l), 1e2)
      .scaled(32, 4, outward * std::sin(l) + s.v_mps[0] * std::cos(l), 1e2)
      .scaled(36, 4, s.v_mps[1] * std::cos(b) + s.v_mps[2] * std::sin(b), 1e2)
      .scaled(40, 4, s.speed_acc_mps, 1e2)
      .scaled(44, 2, s.pdop, 1e2)
      .put(47, 1, s.satellites)
      .bytes();
}

// ---- NMEA

template <class... Values>
std::string text(const char* format, Values... values) {
  std::array<char, 128> out{};
  const int size = std::snprintf(out.data(), out.size(), format, values...);
  return {out.data(), static_cast<std::size_t>(size)};
}

/// Sec. 4.1.1: the checksum is of what is between $ and *, in two digits.
inline Bytes sentence(const std::string& fields) {
  unsigned sum = 0;
  for (const char c : fields) sum ^= static_cast<unsigned char>(c);
  const std::string whole = "$" + fields + text("*%02X\r\n", sum);
  return {whole.begin(), whole.end()};
}

/// Sec. 4.1.5: degrees and minutes with five decimals, then the side; empty fields without a fix (sec. 4.1.8).
inline std::string angle(bool valid, double deg, int digits, const char* sides) {
  if (!valid) return ",";
  constexpr std::int64_t kDegree = 60 * 100'000;
  const std::int64_t whole = std::llround(std::abs(deg) * static_cast<double>(kDegree));
  const auto minutes = static_cast<int>(whole % kDegree);
  return text("%0*d%02d.%05d,%c", digits, static_cast<int>(whole / kDegree), minutes / 100'000, minutes % 100'000,
              sides[deg < 0 ? 1 : 0]);
}
inline std::string place(const Solution& s) {
  return angle(fix_ok(s.fix), s.latitude_deg, 2, "NS") + "," + angle(fix_ok(s.fix), s.longitude_deg, 3, "EW");
}
inline std::string time_of_day(const Instant& t) {
  const auto utc = t.utc(10'000'000);
  return text("%02d%02d%02d.%02d", utc.hour, utc.minute, utc.second,
              static_cast<int>((utc.nano + 5'000'000) / 10'000'000));
}
inline std::string speed(const Solution& s, double per_mps) {
  return fix_ok(s.fix) ? text("%.3f", s.speed_mps() * per_mps) : "";
}
/// Left empty at standstill, where there is none.
inline std::string course(const Solution& s) {
  return fix_ok(s.fix) && s.speed_mps() > 0 ? text("%.2f", s.course_deg()) : "";
}
inline constexpr double kKnotsPerMps = 3600.0 / 1852.0;

/// Sec. 4.1.6, the table of NMEA 4.1: RTK is F or R in RMC and D in VTG and GLL.
inline char pos_mode(Fix fix, bool rmc) {
  if (!fix_ok(fix)) return 'N';
  if (fix == Fix::kRtkFloat) return rmc ? 'F' : 'D';
  if (fix == Fix::kRtkFixed) return rmc ? 'R' : 'D';
  return fix == Fix::kDifferential ? 'D' : 'A';
}

/// Sec. 4.2.14. The year has two digits; after the mode comes navStatus, always V.
inline Bytes rmc(const Solution& s, const Instant& t, const char* talker = "GN") {
  const auto utc = t.utc(10'000'000);
  const std::string date = text("%02d%02d%02d", utc.day, utc.month, utc.year % 100);
  return sentence(talker + std::string("RMC,") + time_of_day(t) + "," + (fix_ok(s.fix) ? "A," : "V,") + place(s) + "," +
                  speed(s, kKnotsPerMps) + "," + course(s) + "," + date + ",,," + pos_mode(s.fix, true) + ",V");
}
/// Sec. 4.2, VTG.
inline Bytes vtg(const Solution& s, const Instant&, const char* talker = "GN") {
  return sentence(talker + std::string("VTG,") + course(s) + ",T,,M," + speed(s, kKnotsPerMps) + ",N," + speed(s, 3.6) +
                  ",K," + pos_mode(s.fix, false));
}
/// Sec. 4.2, GGA: altitude above mean sea level, then what the geoid is above the ellipsoid.
inline Bytes gga(const Solution& s, const Instant& t, const char* talker = "GN") {
  constexpr int kQuality[] = {0, 0, 1, 1, 2, 5, 4};
  const bool ok = fix_ok(s.fix);
  return sentence(talker + std::string("GGA,") + time_of_day(t) + "," + place(s) + "," +
                  text("%d,%02d,%.2f,", kQuality[static_cast<int>(s.fix)], std::min(s.satellites, 12), s.hdop) +
                  (ok ? text("%.1f,M,%.1f,M", s.msl_m, s.height_m - s.msl_m) : ",,,") + ",,");
}
/// Sec. 4.2.11; once for each GNSS (sec. 4.1.7), here for GPS and GLONASS, with the system's number at the end.
inline Bytes gsa(const Solution& s, const Instant&, const char* talker = "GN") {
  const int mode = !fix_ok(s.fix) ? 1 : s.fix == Fix::k2d ? 2 : 3;
  const std::string dop = text("%.2f,%.2f,%.2f", s.pdop, s.hdop, s.vdop);
  Bytes both;
  for (const auto& satellites : {std::string{"29,05,12,,,,,,,,,"}, std::string{"70,71,,,,,,,,,,"}}) {
    const int system = satellites[0] == '2' ? 1 : 2;
    const Bytes one = sentence(talker + text("GSA,A,%d,", mode) + satellites + "," + dop + text(",%d", system));
    both.insert(both.end(), one.begin(), one.end());
  }
  return both;
}
/// Sec. 4.2, GLL.
inline Bytes gll(const Solution& s, const Instant& t, const char* talker = "GN") {
  return sentence(talker + std::string("GLL,") + place(s) + "," + time_of_day(t) + "," + (fix_ok(s.fix) ? "A," : "V,") +
                  pos_mode(s.fix, false));
}
/// Sec. 4.2.12: the ellipse is not output; standard deviations of latitude, longitude, altitude, m.
inline Bytes gst(const Solution& s, const Instant& t, const char* talker = "GN") {
  const auto& c = s.position_cov_m2;
  return sentence(talker + std::string("GST,") + time_of_day(t) + ",1.8,,,," +
                  text("%.1f,%.1f,%.1f", std::sqrt(c[3]), std::sqrt(c[0]), std::sqrt(c[5])));
}

}  // namespace tetap::fakes::ublox
