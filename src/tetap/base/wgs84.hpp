// SPDX-License-Identifier: Apache-2.0
// The WGS84 ellipsoid (NIMA TR8350.2, table 3.1). Latitude, longitude, height to Earth-centred, Earth-fixed coordinates
// and back (Torge & Mueller 2012, sec. 4.1.3), and directions between ECEF and east, north, up. Bit-identical double,
// as for gravity by latitude: a float holds 0.5 m of the Earth's radius.
#pragma once

#include "tetap/base/math_double.hpp"
#include "tetap/base/members.hpp"

#include <cstdint>
#include <optional>

namespace tetap::base {

inline constexpr double kSemiMajor_m = 6378137.0;
inline constexpr double kFlattening = 1.0 / 298.257223563;
inline constexpr double kEccentricity2 = kFlattening * (2.0 - kFlattening);
inline constexpr double kRadPer2ndeg = 2e-9 * 3.14159265358979323846 / 180.0;

/// A place in the bus's units: angles in 2e-9 deg, a tenth of a millimetre; the height is the ellipsoid's.
struct Geodetic {
  std::int64_t latitude_2ndeg = 0;
  std::int64_t longitude_2ndeg = 0;
  double height_m = 0;
};

/// A place or a direction, in any unit.
struct Ecef {
  double x = 0, y = 0, z = 0;
};

/// A direction in the level plane of a place.
struct Enu {
  double east = 0, north = 0, up = 0;
};

/// The axes of the level plane there.
struct Level {
  SinCosDouble latitude{};
  SinCosDouble longitude{};

  constexpr Level() = default;
  static constexpr auto members(auto& self) { return base::members(self.latitude, self.longitude); }
  constexpr Level(std::int64_t latitude_2ndeg, std::int64_t longitude_2ndeg)
      : latitude(sincos(static_cast<double>(latitude_2ndeg) * kRadPer2ndeg)),
        longitude(sincos(static_cast<double>(longitude_2ndeg) * kRadPer2ndeg)) {}

  [[nodiscard]] constexpr Enu to_enu(const Ecef& d) const {
    const double outward = longitude.cos * d.x + longitude.sin * d.y;
    return {.east = longitude.cos * d.y - longitude.sin * d.x,
            .north = latitude.cos * d.z - latitude.sin * outward,
            .up = latitude.cos * outward + latitude.sin * d.z};
  }
  [[nodiscard]] constexpr Ecef to_ecef(const Enu& d) const {
    const double outward = latitude.cos * d.up - latitude.sin * d.north;
    return {.x = longitude.cos * outward - longitude.sin * d.east,
            .y = longitude.sin * outward + longitude.cos * d.east,
            .z = latitude.cos * d.north + latitude.sin * d.up};
  }
};

[[nodiscard]] constexpr Ecef ecef_m(const Level& at, double height_m) {
  const double n = kSemiMajor_m / sqrt(1.0 - kEccentricity2 * at.latitude.sin * at.latitude.sin);
  return {.x = (n + height_m) * at.latitude.cos * at.longitude.cos,
          .y = (n + height_m) * at.latitude.cos * at.longitude.sin,
          .z = (n * (1.0 - kEccentricity2) + height_m) * at.latitude.sin};
}

/// Bowring's formula (Survey Review 23(181), 1976), applied twice. From 6000 km to 60 000 km off the Earth's centre its
/// own error is below 1e-9 m; the rest is the rounding of the result. Empty: further in or out, or not a place.
[[nodiscard]] constexpr std::optional<Geodetic> geodetic_of(const Ecef& p_m) {
  constexpr double kSecondEccentricity2 = kEccentricity2 / (1.0 - kEccentricity2);
  constexpr double kUnitsPerRad = 180.0 / 3.14159265358979323846 / 2e-9;
  const double outward = sqrt(p_m.x * p_m.x + p_m.y * p_m.y);
  const double distance = sqrt(outward * outward + p_m.z * p_m.z);
  if (!(distance > 6.0e6 && distance < 6.0e7)) return {};

  double beta = atan2(p_m.z, (1.0 - kFlattening) * outward);
  double latitude = 0;
  for (int turn = 0; turn < 2; ++turn) {
    const auto b = sincos(beta);
    latitude = atan2(p_m.z + kSecondEccentricity2 * kSemiMajor_m * (1.0 - kFlattening) * b.sin * b.sin * b.sin,
                     outward - kEccentricity2 * kSemiMajor_m * b.cos * b.cos * b.cos);
    const auto l = sincos(latitude);
    beta = atan2((1.0 - kFlattening) * l.sin, l.cos);
  }
  const auto l = sincos(latitude);
  const double longitude = atan2(p_m.y, p_m.x);
  const auto rounded = [](double x) { return static_cast<std::int64_t>(x < 0 ? x - 0.5 : x + 0.5); };
  return Geodetic{
      .latitude_2ndeg = rounded(latitude * kUnitsPerRad),
      .longitude_2ndeg = rounded(longitude * kUnitsPerRad),
      .height_m = outward * l.cos + p_m.z * l.sin - kSemiMajor_m * sqrt(1.0 - kEccentricity2 * l.sin * l.sin)};
}

}  // namespace tetap::base
