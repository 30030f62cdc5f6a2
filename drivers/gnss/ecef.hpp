// SPDX-License-Identifier: Apache-2.0
// Earth-centred coordinates, as old u-blox messages give them, to latitude, longitude, height and to east, north, up:
// Bowring's formula (Survey Review 23(181), 1976), applied twice: below 1 mm from the Earth's core to 60 000 km.
#pragma once

#include "base/math_double.hpp"

#include <array>
#include <cstdint>
#include <optional>

namespace tetap::drivers::gnss {

struct Geodetic {
  std::int64_t latitude_2ndeg = 0;
  std::int64_t longitude_2ndeg = 0;
  double height_m = 0;
};

using Vector3 = std::array<double, 3>;

/// Empty: not a place where a receiver can be.
[[nodiscard]] constexpr std::optional<Geodetic> geodetic_of(const Vector3& p_m) {
  constexpr double kA = 6378137.0;  // WGS84: NIMA TR8350.2, table 3.1
  constexpr double kF = 1.0 / 298.257223563;
  constexpr double kE2 = kF * (2.0 - kF);
  constexpr double kSecondE2 = kE2 / (1.0 - kE2);
  constexpr double kUnitsPerRad = 180.0 / 3.14159265358979323846 / 2e-9;
  const double outward = base::sqrt(p_m[0] * p_m[0] + p_m[1] * p_m[1]);
  const double distance = base::sqrt(outward * outward + p_m[2] * p_m[2]);
  if (!(distance > 6.0e6 && distance < 6.0e7)) return {};

  double beta = base::atan2(p_m[2], (1.0 - kF) * outward);
  double latitude = 0;
  for (int turn = 0; turn < 2; ++turn) {
    const auto b = base::sincos(beta);
    latitude = base::atan2(p_m[2] + kSecondE2 * kA * (1.0 - kF) * b.sin * b.sin * b.sin,
                           outward - kE2 * kA * b.cos * b.cos * b.cos);
    const auto l = base::sincos(latitude);
    beta = base::atan2((1.0 - kF) * l.sin, l.cos);
  }
  const auto l = base::sincos(latitude);
  const double longitude = base::atan2(p_m[1], p_m[0]);
  const auto rounded = [](double x) { return static_cast<std::int64_t>(x < 0 ? x - 0.5 : x + 0.5); };
  return Geodetic{.latitude_2ndeg = rounded(latitude * kUnitsPerRad),
                  .longitude_2ndeg = rounded(longitude * kUnitsPerRad),
                  .height_m = outward * l.cos + p_m[2] * l.sin - kA * base::sqrt(1.0 - kE2 * l.sin * l.sin)};
}

/// A velocity there, east, north, up.
[[nodiscard]] constexpr Vector3 level_of(const Geodetic& at, const Vector3& v_mps) {
  constexpr double kRadPerUnit = 2e-9 * 3.14159265358979323846 / 180.0;
  const auto lat = base::sincos(static_cast<double>(at.latitude_2ndeg) * kRadPerUnit);
  const auto lon = base::sincos(static_cast<double>(at.longitude_2ndeg) * kRadPerUnit);
  const double outward = lon.cos * v_mps[0] + lon.sin * v_mps[1];
  return {lon.cos * v_mps[1] - lon.sin * v_mps[0], lat.cos * v_mps[2] - lat.sin * outward,
          lat.cos * outward + lat.sin * v_mps[2]};
}

}  // namespace tetap::drivers::gnss
