// SPDX-License-Identifier: Apache-2.0
// Latitude, longitude, height to the local level plane (east, north, up) and back, on WGS84 (NIMA TR8350.2, table 3.1).
// Through ECEF (Torge & Mueller 2012, sec. 4.1.3), in the bit-identical double of src/base: the only place where double
// is used.
#pragma once

#include "base/math.hpp"
#include "base/math_double.hpp"

#include <cstdint>

namespace tetap::nav {

inline constexpr double kSemiMajor_m = 6378137.0;
inline constexpr double kFlattening = 1.0 / 298.257223563;
inline constexpr double kEccentricity2 = kFlattening * (2.0 - kFlattening);
inline constexpr double kRadPer2ndeg = 2e-9 * 3.14159265358979323846 / 180.0;

/// Relative to an origin, integer micrometres. Not valid: further than 1000 km from the origin, or not a place on
/// Earth.
struct Local {
  std::int64_t east_um = 0;
  std::int64_t north_um = 0;
  std::int64_t up_um = 0;
  bool valid = false;
};

class LocalFrame {
 public:
  constexpr LocalFrame() = default;
  constexpr LocalFrame(std::int64_t latitude_2ndeg, std::int64_t longitude_2ndeg, float height_m)
      : latitude_2ndeg_(latitude_2ndeg),
        longitude_2ndeg_(longitude_2ndeg),
        height_m_(height_m),
        latitude_(base::sincos(static_cast<double>(latitude_2ndeg) * kRadPer2ndeg)),
        longitude_(base::sincos(static_cast<double>(longitude_2ndeg) * kRadPer2ndeg)),
        origin_(ecef(latitude_, longitude_, static_cast<double>(height_m))) {}

  [[nodiscard]] constexpr std::int64_t latitude_2ndeg() const { return latitude_2ndeg_; }
  [[nodiscard]] constexpr std::int64_t longitude_2ndeg() const { return longitude_2ndeg_; }
  [[nodiscard]] constexpr float height_m() const { return height_m_; }

  /// A height that is not available counts as the origin's.
  [[nodiscard]] constexpr Local to_local(std::int64_t latitude_2ndeg, std::int64_t longitude_2ndeg,
                                         float height_m) const {
    constexpr std::int64_t kQuarterTurn = 45'000'000'000;
    if (latitude_2ndeg > kQuarterTurn || latitude_2ndeg < -kQuarterTurn || longitude_2ndeg > 4 * kQuarterTurn ||
        longitude_2ndeg < -4 * kQuarterTurn) {
      return {};
    }
    const double height = base::is_finite(height_m) ? static_cast<double>(height_m) : static_cast<double>(height_m_);
    const auto p = ecef(base::sincos(static_cast<double>(latitude_2ndeg) * kRadPer2ndeg),
                        base::sincos(static_cast<double>(longitude_2ndeg) * kRadPer2ndeg), height);
    const double dx = p.x - origin_.x;
    const double dy = p.y - origin_.y;
    const double dz = p.z - origin_.z;
    const double outward = longitude_.cos * dx + longitude_.sin * dy;
    const double east = longitude_.cos * dy - longitude_.sin * dx;
    const double north = latitude_.cos * dz - latitude_.sin * outward;
    const double up = latitude_.cos * outward + latitude_.sin * dz;
    if (!near(east) || !near(north) || !near(up)) return {};
    return {.east_um = micrometres(east), .north_um = micrometres(north), .up_um = micrometres(up), .valid = true};
  }

 private:
  struct Ecef {
    double x = 0, y = 0, z = 0;
  };
  static constexpr Ecef ecef(const base::SinCosDouble& latitude, const base::SinCosDouble& longitude, double height) {
    const double n = kSemiMajor_m / base::sqrt(1.0 - kEccentricity2 * latitude.sin * latitude.sin);
    return {(n + height) * latitude.cos * longitude.cos, (n + height) * latitude.cos * longitude.sin,
            (n * (1.0 - kEccentricity2) + height) * latitude.sin};
  }
  static constexpr bool near(double m) { return m > -1e6 && m < 1e6; }
  static constexpr std::int64_t micrometres(double m) {
    return static_cast<std::int64_t>(m * 1e6 + (m < 0 ? -0.5 : 0.5));
  }

  std::int64_t latitude_2ndeg_ = 0;
  std::int64_t longitude_2ndeg_ = 0;
  float height_m_ = 0;
  base::SinCosDouble latitude_{};
  base::SinCosDouble longitude_{};
  Ecef origin_{};
};

}  // namespace tetap::nav
