// SPDX-License-Identifier: Apache-2.0
// Messages of a u-blox receiver on one epoch, as bytes. Manuals: UBX-18010854 (R04) sec. 4 (NMEA), 5.2 to 5.4 (frames),
// 5.14 (NAV); UBX-22008968 sec. 3.15.2 (NAV-COV); UBX-13003221 (NAV-SOL, NAV-VELNED); UBX-18010802 (UTC).
#pragma once

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <string>
#include <type_traits>
#include <vector>

namespace tetap::fakes::ublox {

using Bytes = std::vector<std::uint8_t>;

/// kLimits: a fix beyond the user's masks of DOP and accuracy, so not valid (sec. 5.14.11 gnssFixOK, sec. 4.1.6).
enum class Fix : std::uint8_t { kNone, kLimits, k2d, k3d, kDifferential, kRtkFloat, kRtkFixed };

/// Upper triangle in the order EE, EN, EU, NN, NU, UU.
using Covariance = std::array<double, 6>;

/// Solution of the receiver at one epoch, in SI and east, north, up.
struct Solution {
  Fix fix = Fix::k3d;
  int satellites = 17;
  double latitude_deg = 47.285233, longitude_deg = 8.565265;
  double height_m = 546.6, msl_m = 499.6;  ///< above the ellipsoid, above mean sea level
  std::array<double, 3> v_mps{};
  double horizontal_acc_m = 1.234, vertical_acc_m = 2.345, speed_acc_mps = 0.321, course_acc_deg = 0.45;
  double pdop = 1.94, hdop = 1.18, vdop = 1.54;
  std::array<double, 3> baseline_m{0.3, 0.9, 0.01};  ///< from the moving reference antenna to this one
  double baseline_acc_m = 0.01;                      ///< 1 sigma of each component and of the length
  Covariance position_cov_m2{0.25, 0.05, -0.02, 2.25, 0.03, 1.21};
  Covariance velocity_cov_m2ps2{0.01, 0.002, -0.001, 0.0225, 0.003, 0.04};

  [[nodiscard]] double speed_mps() const { return std::hypot(v_mps[0], v_mps[1]); }
  /// Clockwise from north, 0 to 360.
  [[nodiscard]] double course_deg() const {
    const double course = std::atan2(v_mps[0], v_mps[1]) * 180 / M_PI;
    return course < 0 ? course + 360 : course;
  }
  /// Valid and within the masks: what gnssFixOK says.
  [[nodiscard]] bool valid() const { return fix >= Fix::k2d; }
  [[nodiscard]] bool corrected() const { return fix >= Fix::kDifferential; }
};

/// Time of an epoch: GPS week, milliseconds of it, and what the epoch truly lies beside them.
struct Instant {
  int week = 2306;
  std::uint32_t itow_ms = 0;
  std::int32_t beside_ns = 0;
  int leap_s = 18;

  struct Utc {
    int year, month, day, hour, minute, second;
    std::int64_t nano;
  };

  /// UBX-18010802, UTC representation: date and time come from rounding to 10 ms, the same in UBX and NMEA. nano brings
  /// them back to the truth: -5 000 000 to 994 999 999.
  [[nodiscard]] Utc utc() const {
    using namespace std::chrono;
    // IS-GPS-200 sec. 3.3.4: week 0 began at midnight before 6 January 1980; GPS time has no leap seconds.
    constexpr sys_days kWeek0{year{1980} / January / 6};
    const std::int64_t gps_ns = (std::int64_t{week} * 604'800'000 + itow_ms) * 1'000'000 + beside_ns;
    const std::int64_t utc_ns = gps_ns - std::int64_t{leap_s} * 1'000'000'000;
    constexpr std::int64_t kGrid_ns = 10'000'000;
    const auto down = [](std::int64_t ns, std::int64_t grid) { return (ns >= 0 ? ns : ns - grid + 1) / grid; };
    const std::int64_t shown_ns = down(utc_ns + kGrid_ns / 2, kGrid_ns) * kGrid_ns;
    const std::int64_t whole_s = down(shown_ns, 1'000'000'000);
    const sys_seconds at = sys_seconds{kWeek0} + seconds{whole_s};
    const year_month_day date{floor<days>(at)};
    const hh_mm_ss clock{at - floor<days>(at)};
    return {static_cast<int>(date.year()),
            static_cast<int>(static_cast<unsigned>(date.month())),
            static_cast<int>(static_cast<unsigned>(date.day())),
            static_cast<int>(clock.hours().count()),
            static_cast<int>(clock.minutes().count()),
            static_cast<int>(clock.seconds().count()),
            utc_ns - whole_s * 1'000'000'000};
  }
};

inline constexpr std::uint8_t kNav = 0x01;
inline constexpr std::uint8_t kNavPosLlh = 0x02, kNavDop = 0x04, kNavSol = 0x06, kNavPvt = 0x07, kNavVelNed = 0x12,
                              kNavHpPosLlh = 0x14, kNavTimeUtc = 0x21, kNavCov = 0x36, kNavRelPosNed = 0x3C;

/// Sec. 5.4: Fletcher's sum over class, id, length and payload.
inline std::array<std::uint8_t, 2> checksum(const std::uint8_t* from, std::size_t n) {
  std::uint8_t a = 0, b = 0;
  for (std::size_t i = 0; i < n; ++i) {
    a = static_cast<std::uint8_t>(a + from[i]);
    b = static_cast<std::uint8_t>(b + a);
  }
  return {a, b};
}

/// Sec. 5.2: two sync bytes, class, id, length without frame, payload, checksum.
inline Bytes frame(std::uint8_t message_class, std::uint8_t id, const Bytes& payload) {
  const auto n = payload.size();
  Bytes out(n + 8);
  const std::array<std::uint8_t, 6> head{
      0xB5, 0x62, message_class, id, static_cast<std::uint8_t>(n & 0xFF), static_cast<std::uint8_t>(n >> 8)};
  std::ranges::copy(head, out.begin());
  std::ranges::copy(payload, out.begin() + 6);
  std::ranges::copy(checksum(out.data() + 2, n + 4), out.end() - 2);
  return out;
}

/// Puts numbers in the order of sec. 5.3.1: little endian, two's complement, IEEE 754.
class Payload {
 public:
  template <class T>
  Payload& put(std::type_identity_t<T> value) {
    std::array<std::uint8_t, sizeof(T)> raw;
    std::memcpy(raw.data(), &value, sizeof(T));  // the machines that run this are little endian
    bytes_.insert(bytes_.end(), raw.begin(), raw.end());
    return *this;
  }
  Payload& u1(std::uint32_t v) { return put<std::uint8_t>(static_cast<std::uint8_t>(v)); }
  Payload& u2(std::uint32_t v) { return put<std::uint16_t>(static_cast<std::uint16_t>(v)); }
  Payload& u4(std::uint32_t v) { return put<std::uint32_t>(v); }
  Payload& i4(std::int64_t v) { return put<std::int32_t>(static_cast<std::int32_t>(v)); }
  /// A number in units of 1 / `per_unit`, to the nearest.
  Payload& i4(double v, double per_unit) { return i4(std::int64_t{std::llround(v * per_unit)}); }
  Payload& u4(double v, double per_unit) { return u4(static_cast<std::uint32_t>(std::llround(v * per_unit))); }
  Payload& u2(double v, double per_unit) { return u2(static_cast<std::uint32_t>(std::llround(v * per_unit))); }
  Payload& i1(std::int64_t v) { return put<std::int8_t>(static_cast<std::int8_t>(v)); }
  Payload& r4(double v) { return put<float>(static_cast<float>(v)); }
  Payload& zeros(std::size_t n) { return bytes_.insert(bytes_.end(), n, 0), *this; }
  Payload& chars(const char* text, std::size_t n) {
    for (std::size_t i = 0, end = std::strlen(text); i < n; ++i) u1(i < end ? static_cast<std::uint8_t>(text[i]) : 0);
    return *this;
  }
  [[nodiscard]] const Bytes& bytes() const { return bytes_; }

 private:
  Bytes bytes_;
};

namespace detail {

/// Sec. 5.14.11 fixType: does not say that the fix is valid, so kLimits has one as well.
inline std::uint32_t fix_type(const Solution& s) { return s.fix == Fix::kNone ? 0U : s.fix == Fix::k2d ? 2U : 3U; }

/// Open is what stands in the numbers without a fix: here the last ones stay, and only type and accuracy tell.
inline Payload& accuracy(Payload& p, const Solution& s, double metres, double per_metre) {
  return s.fix == Fix::kNone ? p.u4(0xFFFFFFFF) : p.u4(metres, per_metre);
}

/// NMEA and UBX say 99.99 for a DOP that is not known.
inline double dop(const Solution& s, double value) { return s.fix == Fix::kNone ? 99.99 : std::fmin(value, 99.99); }

inline Payload& date_and_time(Payload& p, const Instant::Utc& u) {
  const auto part = [](int v) { return static_cast<std::uint32_t>(v); };
  p.u2(part(u.year)).u1(part(u.month)).u1(part(u.day));
  return p.u1(part(u.hour)).u1(part(u.minute)).u1(part(u.second));
}

/// In NED: down is minus up, so the terms with one vertical part change sign.
inline Payload& covariance(Payload& p, const Covariance& enu) {
  const auto [ee, en, eu, nn, nu, uu] = enu;
  return p.r4(nn).r4(en).r4(-nu).r4(ee).r4(-eu).r4(uu);
}

}  // namespace detail

/// Sec. 5.14.11, 92 bytes.
inline Bytes nav_pvt(const Instant& at, const Solution& s) {
  Payload p;
  const Instant::Utc utc = at.utc();
  p.u4(at.itow_ms);
  // Time is valid without a fix too, as after losing lock: a host must not take one for the other.
  detail::date_and_time(p, utc).u1(0x07).u4(25).i4(utc.nano);
  const std::uint32_t carrier = s.fix == Fix::kRtkFixed ? 2 : s.fix == Fix::kRtkFloat ? 1 : 0;
  p.u1(detail::fix_type(s)).u1((s.valid() ? 1U : 0U) | (s.corrected() ? 2U : 0U) | carrier << 6);
  p.u1(0xE0).u1(s.fix == Fix::kNone ? 0 : static_cast<std::uint32_t>(s.satellites));
  p.i4(s.longitude_deg, 1e7).i4(s.latitude_deg, 1e7).i4(s.height_m, 1e3).i4(s.msl_m, 1e3);
  detail::accuracy(p, s, s.horizontal_acc_m, 1e3);
  detail::accuracy(p, s, s.vertical_acc_m, 1e3);
  p.i4(s.v_mps[1], 1e3).i4(s.v_mps[0], 1e3).i4(-s.v_mps[2], 1e3);
  p.i4(s.speed_mps(), 1e3).i4(s.course_deg(), 1e5);
  detail::accuracy(p, s, s.speed_acc_mps, 1e3).u4(s.fix == Fix::kNone ? 180 : s.course_acc_deg, 1e5);
  p.u2(detail::dop(s, s.pdop), 100);
  // flags3 (HPG 1.32 sec. 3.15): invalidLlh; age of corrections up to 1 s. Reserved in older manuals.
  p.u2((s.fix == Fix::kNone ? 1U : 0U) | (s.corrected() ? 1U : 0U) << 1).zeros(4);
  // headVeh is the course when there is no heading of the vehicle.
  return p.i4(s.course_deg(), 1e5).zeros(4).bytes();
}

/// UBX-22008968 sec. 3.15.2, 64 bytes. It knows no masks, so kLimits leaves it valid.
inline Bytes nav_cov(const Instant& at, const Solution& s) {
  Payload p;
  const std::uint32_t valid = s.fix != Fix::kNone;
  p.u4(at.itow_ms).u1(0).u1(valid).u1(valid).zeros(9);
  detail::covariance(p, s.position_cov_m2);
  return detail::covariance(p, s.velocity_cov_m2ps2).bytes();
}

/// Sec. 5.14.2, 18 bytes. Values that Solution lacks (time, north, east) are made up to fit.
inline Bytes nav_dop(const Instant& at, const Solution& s) {
  const double time = s.hdop, horizontal_part = s.hdop / std::sqrt(2.0);
  Payload p;
  p.u4(at.itow_ms);
  for (const double v : {std::hypot(s.pdop, time), s.pdop, time, s.vdop, s.hdop, horizontal_part, horizontal_part}) {
    p.u2(detail::dop(s, v), 100);
  }
  return p.bytes();
}

/// Sec. 5.14.10, 28 bytes. Nothing in it says whether there is a fix.
inline Bytes nav_posllh(const Instant& at, const Solution& s) {
  Payload p;
  p.u4(at.itow_ms).i4(s.longitude_deg, 1e7).i4(s.latitude_deg, 1e7).i4(s.height_m, 1e3).i4(s.msl_m, 1e3);
  detail::accuracy(p, s, s.horizontal_acc_m, 1e3);
  return detail::accuracy(p, s, s.vertical_acc_m, 1e3).bytes();
}

namespace detail {
/// A number in units of 1 / `per_unit`, of which the last two digits (`base` 100) or the last one (10) stand elsewhere.
struct Split {
  std::int64_t whole, part;
  Split(double v, double per_unit, std::int64_t base)
      : whole(std::llround(v * per_unit) / base), part(std::llround(v * per_unit) % base) {}
};
}  // namespace detail

/// UBX-22008968 sec. 3.15, NAV-HPPOSLLH, 36 bytes: 1e-9 deg and 0.1 mm in two parts each.
inline Bytes nav_hpposllh(const Instant& at, const Solution& s) {
  const detail::Split lon(s.longitude_deg, 1e9, 100), lat(s.latitude_deg, 1e9, 100);
  const detail::Split height(s.height_m, 1e4, 10), msl(s.msl_m, 1e4, 10);
  Payload p;
  p.zeros(3).u1(s.fix == Fix::kNone ? 1 : 0).u4(at.itow_ms);
  p.i4(lon.whole).i4(lat.whole).i4(height.whole).i4(msl.whole);
  p.i1(lon.part).i1(lat.part).i1(height.part).i1(msl.part);
  detail::accuracy(p, s, s.horizontal_acc_m, 1e4);
  return detail::accuracy(p, s, s.vertical_acc_m, 1e4).bytes();
}

/// UBX-22008968 sec. 3.15, NAV-RELPOSNED version 1, 64 bytes, of a receiver with moving base.
inline Bytes nav_relposned(const Instant& at, const Solution& s) {
  const auto [east, north, up] = s.baseline_m;
  const double level = std::hypot(east, north), length = std::hypot(level, up);
  const detail::Split n(north, 1e4, 100), e(east, 1e4, 100), d(-up, 1e4, 100), l(length, 1e4, 100);
  const double heading_deg = std::atan2(east, north) * 180 / M_PI;
  Payload p;
  p.u1(1).zeros(3).u4(at.itow_ms).i4(n.whole).i4(e.whole).i4(d.whole).i4(l.whole);
  p.i4(heading_deg < 0 ? heading_deg + 360 : heading_deg, 1e5).zeros(4);
  p.i1(n.part).i1(e.part).i1(d.part).i1(l.part);
  for (int i = 0; i < 4; ++i) p.u4(s.baseline_acc_m, 1e4);
  p.u4(s.baseline_acc_m / level * 180 / M_PI, 1e5).zeros(4);
  const std::uint32_t carrier = s.fix == Fix::kRtkFixed ? 0x10 : s.fix == Fix::kRtkFloat ? 0x08 : 0;
  const bool valid = carrier != 0;
  return p.u4((s.valid() ? 1U : 0U) | (s.corrected() ? 2U : 0U) | (valid ? 0x104U : 0U) | carrier | 0x20U).bytes();
}

/// UBX-13003221, NAV-SOL, 52 bytes: earth-centred, in cm and cm/s.
inline Bytes nav_sol(const Instant& at, const Solution& s) {
  constexpr double kA_m = 6378137.0, kE2 = 6.69437999014e-3;  // WGS 84
  const double lat = s.latitude_deg * M_PI / 180, lon = s.longitude_deg * M_PI / 180;
  const double sin_lat = std::sin(lat), cos_lat = std::cos(lat), sin_lon = std::sin(lon), cos_lon = std::cos(lon);
  const double normal = kA_m / std::sqrt(1 - kE2 * sin_lat * sin_lat);
  const double across = (normal + s.height_m) * cos_lat;
  const auto [east, north, up] = s.v_mps;
  const double outward = up * cos_lat - north * sin_lat;
  Payload p;
  p.u4(at.itow_ms).i4(std::int64_t{at.beside_ns}).u2(static_cast<std::uint32_t>(at.week));
  // Week and time of week are known whenever the time is.
  p.u1(detail::fix_type(s)).u1((s.valid() ? 1U : 0U) | (s.corrected() ? 2U : 0U) | 0x0CU);
  p.i4(across * cos_lon, 100).i4(across * sin_lon, 100).i4((normal * (1 - kE2) + s.height_m) * sin_lat, 100);
  detail::accuracy(p, s, std::hypot(s.horizontal_acc_m, s.vertical_acc_m), 100);
  p.i4(outward * cos_lon - east * sin_lon, 100).i4(outward * sin_lon + east * cos_lon, 100);
  p.i4(north * cos_lat + up * sin_lat, 100);
  detail::accuracy(p, s, s.speed_acc_mps, 100);
  p.u2(detail::dop(s, s.pdop), 100).zeros(1).u1(s.fix == Fix::kNone ? 0 : static_cast<std::uint32_t>(s.satellites));
  return p.zeros(4).bytes();
}

/// UBX-13003221, NAV-VELNED, 36 bytes, in cm/s.
inline Bytes nav_velned(const Instant& at, const Solution& s) {
  Payload p;
  p.u4(at.itow_ms).i4(s.v_mps[1], 100).i4(s.v_mps[0], 100).i4(-s.v_mps[2], 100);
  p.u4(std::hypot(s.speed_mps(), s.v_mps[2]), 100).u4(s.speed_mps(), 100).i4(s.course_deg(), 1e5);
  detail::accuracy(p, s, s.speed_acc_mps, 100);
  return p.u4(s.fix == Fix::kNone ? 180 : s.course_acc_deg, 1e5).bytes();
}

/// NAV-TIMEUTC, 20 bytes; validTOW, validWKN, validUTC as NAV-PVT's flags of time.
inline Bytes nav_timeutc(const Instant& at) {
  Payload p;
  const Instant::Utc utc = at.utc();
  p.u4(at.itow_ms).u4(25).i4(utc.nano);
  return detail::date_and_time(p, utc).u1(0x07).bytes();
}

namespace nmea {

template <class... A>
std::string text(const char* format, A... values) {
  std::array<char, 64> line;
  std::snprintf(line.data(), line.size(), format, values...);
  return line.data();
}

/// Sec. 4.1.1: exclusive or of all between $ and *. Talker GN, as more than one GNSS is on (sec. 4.1.7).
inline std::string sentence(const std::string& body) {
  const std::string inner = "GN" + body;
  unsigned sum = 0;
  for (const char c : inner) sum ^= static_cast<unsigned char>(c);
  return "$" + inner + text("*%02X\r\n", sum);
}

/// hhmmss.ss, on the grid of 10 ms that utc() has rounded to.
inline std::string time(const Instant& at) {
  const Instant::Utc u = at.utc();
  return text("%02d%02d%02d.%02d", u.hour, u.minute, u.second, static_cast<int>((u.nano + 5'000'000) / 10'000'000));
}

/// ddmm.mmmmm and the letter of the half (sec. 4.1.5); counted in whole 1e-5 minutes, so 60 minutes never show.
inline std::string angle(double deg, int digits, char positive, char negative) {
  const long long units = std::llround(std::fabs(deg) * 6e6);
  return text("%0*lld%02lld.%05lld,%c", digits, units / 6'000'000, units / 100'000 % 60, units % 100'000,
              deg < 0 ? negative : positive);
}

/// Sec. 4.1.8: what is not valid is an empty field.
inline std::string position(const Solution& s) {
  if (!s.valid()) return ",,,";
  return angle(s.latitude_deg, 2, 'N', 'S') + "," + angle(s.longitude_deg, 3, 'E', 'W');
}

inline char status(const Solution& s) { return s.valid() ? 'A' : 'V'; }
/// Sec. 4.1.6, NMEA 4.1: GLL and VTG have no letters for RTK, RMC has.
inline char mode(const Solution& s) { return !s.valid() ? 'N' : s.corrected() ? 'D' : 'A'; }
inline char rmc_mode(const Solution& s) {
  return s.fix == Fix::kRtkFixed ? 'R' : s.fix == Fix::kRtkFloat ? 'F' : mode(s);
}
inline int quality(const Solution& s) {
  return s.fix == Fix::kRtkFixed ? 4 : s.fix == Fix::kRtkFloat ? 5 : !s.valid() ? 0 : s.corrected() ? 2 : 1;
}

inline constexpr double kKnotsPerMps = 3600.0 / 1852.0;

/// CFG-NMEA-OUT_FROZENCOG is off: a course that stands still is not output. The threshold is open: 0.1 m/s here.
inline std::string course(const Solution& s) { return s.speed_mps() < 0.1 ? "" : text("%.2f", s.course_deg()); }

/// Sec. 4.2.14 RMC. Magnetic variation is empty, navStatus always V.
inline std::string rmc(const Instant& at, const Solution& s) {
  const Instant::Utc u = at.utc();
  std::string body = "RMC," + time(at) + "," + status(s) + "," + position(s) + ",";
  body += s.valid() ? text("%.3f,", s.speed_mps() * kKnotsPerMps) + course(s) : ",";
  return sentence(body + text(",%02d%02d%02d,,,%c,V", u.day, u.month, u.year % 100, rmc_mode(s)));
}

/// VTG; without a fix even the letters of the units go.
inline std::string vtg(const Instant&, const Solution& s) {
  if (!s.valid()) return sentence("VTG,,,,,,,,,N");
  return sentence("VTG," + course(s) +
                  text(",T,,M,%.3f,N,%.3f,K,%c", s.speed_mps() * kKnotsPerMps, s.speed_mps() * 3.6, mode(s)));
}

/// Sec. 4.2.4 GGA. numSV goes to 12, however many there are.
inline std::string gga(const Instant& at, const Solution& s) {
  const int used = s.fix == Fix::kNone ? 0 : std::min(s.satellites, 12);
  std::string body = "GGA," + time(at) + "," + position(s);
  body += text(",%d,%02d,%.2f,", quality(s), used, detail::dop(s, s.hdop));
  body += s.valid() ? text("%.1f,M,%.1f,M,", s.msl_m, s.height_m - s.msl_m) : ",,,,";
  return sentence(body + (s.corrected() ? "1.0,0000" : ","));
}

/// Sec. 4.2.11 and 4.1.7: one GSA for each GNSS, of at most 12 satellites; the last field says which.
inline std::string gsa(const Instant&, const Solution& s) {
  constexpr int kSystems = 4;
  const int used = s.fix == Fix::kNone ? 0 : s.satellites;
  std::string all;
  for (int system = 0; system < kSystems; ++system) {
    const int here = std::min(12, used / kSystems + (system < used % kSystems ? 1 : 0));
    std::string body = text("GSA,A,%c", !s.valid() ? '1' : s.fix == Fix::k2d ? '2' : '3');
    // GLONASS counts from 65, the others from 1 (appendix, satellite numbering).
    for (int i = 0; i < 12; ++i) body += i < here ? text(",%02d", (system == 1 ? 65 : 1) + 2 * i) : ",";
    body +=
        text(",%.2f,%.2f,%.2f,%d", detail::dop(s, s.pdop), detail::dop(s, s.hdop), detail::dop(s, s.vdop), system + 1);
    all += sentence(body);
  }
  return all;
}

/// GLL: as the examples of sec. 4.1.8, the time stays without a fix.
inline std::string gll(const Instant& at, const Solution& s) {
  return sentence("GLL," + position(s) + "," + time(at) + "," + status(s) + "," + mode(s));
}

/// Sec. 4.2.12 GST. The ellipse is empty in the manual's example, so here.
inline std::string gst(const Instant& at, const Solution& s) {
  std::string body = "GST," + time(at);
  if (!s.valid()) return sentence(body + ",,,,,,,");
  const Covariance& c = s.position_cov_m2;
  return sentence(body + text(",1.8,,,,%.1f,%.1f,%.1f", std::sqrt(c[3]), std::sqrt(c[0]), std::sqrt(c[5])));
}

}  // namespace nmea

}  // namespace tetap::fakes::ublox
