// SPDX-License-Identifier: Apache-2.0
// One epoch of a GNSS receiver, whichever protocol it spoke, in SI units and the frame n (east, north, up). Estimators
// take its samples. A field that the receiver did not send is NaN or empty.
#pragma once

#include "tetap/base/float_bits.hpp"
#include "tetap/base/math.hpp"
#include "tetap/sensor/samples.hpp"

#include <array>
#include <cstdint>
#include <optional>

namespace tetap::drivers::gnss {

enum class Protocol : std::uint8_t { kUbx, kNmea };

/// UTC as the receiver sent it. The second may be 60.
struct Utc {
  std::uint16_t year = 0;
  std::uint8_t month = 0, day = 0, hour = 0, minute = 0, second = 0;
  std::int32_t nano = 0;  ///< u-blox rounds the second, so this may be negative (UBX-NAV-PVT, field nano)
  bool date_valid = false;
  bool time_valid = false;

  friend constexpr bool operator==(const Utc&, const Utc&) = default;
};

/// Upper triangle in the order EE, EN, EU, NN, NU, UU.
using Covariance = std::array<float, 6>;

struct Report {
  Protocol protocol = Protocol::kUbx;
  sensor::GnssFix fix = sensor::GnssFix::kNone;
  std::uint8_t satellites = 0;
  bool has_position = false;             ///< the two angles below mean something
  std::optional<std::uint32_t> itow_ms;  ///< GPS time of week; UBX only
  Utc utc{};
  bool time_uncertain = false;      ///< other fixes have the same time of day: a receiver that cuts fractions off
  std::int64_t latitude_2ndeg = 0;  ///< units of 2e-9 deg, WGS84
  std::int64_t longitude_2ndeg = 0;
  float height_m = base::kNan;      ///< above the ellipsoid
  float height_msl_m = base::kNan;  ///< above mean sea level, by the receiver's geoid
  float horizontal_acc_m = base::kNan;
  float vertical_acc_m = base::kNan;
  std::array<float, 3> v_n_mps{base::kNan, base::kNan, base::kNan};
  float speed_mps = base::kNan;   ///< over ground
  float course_rad = base::kNan;  ///< clockwise from north, as receivers send it
  float speed_acc_mps = base::kNan;
  float course_acc_rad = base::kNan;
  float pdop = base::kNan, hdop = base::kNan, vdop = base::kNan;
  std::optional<Covariance> position_cov_m2;
  std::optional<Covariance> velocity_cov_m2ps2;

  /// A place on Earth that the receiver itself calls valid.
  [[nodiscard]] constexpr bool usable() const { return has_position && fix >= sensor::GnssFix::k2d; }
};

/// Line between two antennas of one robot, from the moving reference antenna to the rover's, at one time of week.
struct Baseline {
  std::optional<std::uint32_t> itow_ms;  ///< GPS time of week; UBX only
  bool valid = false;                    ///< course usable as a heading; the driver counts the others
  std::array<float, 3> n_m{base::kNan, base::kNan, base::kNan};  ///< east, north, up; NaN: only its direction is known
  float length_m = base::kNan;
  float length_acc_m = base::kNan;
  float course_rad = base::kNan;  ///< direction of the line, clockwise from true north
  float course_acc_rad = base::kNan;
};

/// Heading of the line, counter-clockwise from east, in the level frame of the place; empty: not valid. The filter's
/// `gnss.baseline_b_m` is the same line in the body: from the reference antenna to the rover's.
[[nodiscard]] constexpr std::optional<sensor::OutsideHeading> heading_of(const Baseline& baseline) {
  if (!baseline.valid) return {};
  return sensor::OutsideHeading{.yaw_rad = base::wrap_angle(0.5F * base::kPi - baseline.course_rad),
                                .acc_rad = baseline.course_acc_rad};
}

/// Position that a filter may fuse; empty: this epoch has none, or none the receiver vouches for. From the covariance,
/// where it came, the accuracies are the axes' own; else the receiver's figure is passed on as it is.
[[nodiscard]] constexpr std::optional<sensor::GnssPosition> position_of(const Report& report) {
  if (!report.usable()) return {};
  sensor::GnssPosition p{.latitude_2ndeg = report.latitude_2ndeg,
                         .longitude_2ndeg = report.longitude_2ndeg,
                         .height_m = report.fix == sensor::GnssFix::k2d ? base::kNan : report.height_m,
                         .horizontal_acc_m = report.horizontal_acc_m,
                         .vertical_acc_m = report.vertical_acc_m,
                         .fix = report.fix,
                         .satellites = report.satellites};
  if (const auto& c = report.position_cov_m2) {
    p.horizontal_acc_m = base::sqrt(0.5F * ((*c)[0] + (*c)[3]));
    p.vertical_acc_m = base::sqrt((*c)[5]);
  }
  return p;
}

/// Up may be NaN: NMEA has no vertical speed.
[[nodiscard]] constexpr std::optional<sensor::GnssVelocity> velocity_of(const Report& report) {
  if (report.fix < sensor::GnssFix::k2d || base::is_nan(report.v_n_mps[0]) || base::is_nan(report.v_n_mps[1]))
    return {};
  sensor::GnssVelocity v{.v_n_mps = report.v_n_mps, .acc_mps = report.speed_acc_mps};
  if (const auto& c = report.velocity_cov_m2ps2) {
    v.acc_mps = base::sqrt(((*c)[0] + (*c)[3] + (*c)[5]) * (1.0F / 3.0F));
  }
  return v;
}

}  // namespace tetap::drivers::gnss
