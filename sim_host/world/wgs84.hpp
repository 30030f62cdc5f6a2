// SPDX-License-Identifier: Apache-2.0
// WGS84 for the world, in double and apart from the firmware's own, so that one judges the other.
// Ellipsoid and normal gravity: NIMA TR8350.2, 3rd ed. (2000), sec. 3 and 4. ECEF to geodetic: the fixed point of
// Hofmann-Wellenhof, Lichtenegger, Wasle, GNSS (2008), sec. 8.2.1; it gains three digits a round near the ellipsoid.
#pragma once

#include "sim_host/world/math.hpp"

#include <array>
#include <cstdint>

namespace tetap::sim {

struct GeodeticOrigin {
  double latitude_deg = 0;
  double longitude_deg = 0;
  double height_m = 0;  ///< above the ellipsoid
};

/// A place in the bus's units: angles in 2e-9 deg.
struct GeodeticPoint {
  std::int64_t latitude_2ndeg = 0;
  std::int64_t longitude_2ndeg = 0;
  double height_m = 0;
};

class Wgs84 {
 public:
  static constexpr double kA = 6378137.0;
  static constexpr double kF = 1 / 298.257223563;
  static constexpr double kE2 = kF * (2 - kF);
  static constexpr double kEarthRate_radps = 7.292115e-5;

  explicit Wgs84(const GeodeticOrigin& origin)
      : origin_{origin},
        latitude_{direction(radians(origin.latitude_deg))},
        longitude_{direction(radians(origin.longitude_deg))},
        origin_ecef_m_{ecef(latitude_, longitude_, origin.height_m)} {}

  [[nodiscard]] const GeodeticOrigin& origin() const { return origin_; }

  /// The point `enu_m` east, north and up of the origin.
  [[nodiscard]] GeodeticPoint geodetic(const std::array<double, 3>& enu_m) const {
    const auto [e, n, u] = enu_m;
    const double radial = latitude_.cos * u - latitude_.sin * n;  // away from the axis, in the origin's meridian plane
    const double x = origin_ecef_m_[0] - longitude_.sin * e + longitude_.cos * radial;
    const double y = origin_ecef_m_[1] + longitude_.cos * e + longitude_.sin * radial;
    const double z = origin_ecef_m_[2] + latitude_.cos * n + latitude_.sin * u;

    const double p = sim::sqrt(x * x + y * y);
    double latitude_rad = sim::atan2(z, p * (1 - kE2));
    double height_m = 0;
    for (int round = 0; round < 6; ++round) {
      const Direction d = direction(latitude_rad);
      const double normal_m = prime_vertical_m(d.sin);
      height_m = p * d.cos + z * d.sin - kA * sim::sqrt(1 - kE2 * d.sin * d.sin);
      latitude_rad = sim::atan2(z, p * (1 - kE2 * normal_m / (normal_m + height_m)));
    }
    return {.latitude_2ndeg = units(latitude_rad), .longitude_2ndeg = units(sim::atan2(y, x)), .height_m = height_m};
  }

  /// East, north, up of the origin.
  [[nodiscard]] std::array<double, 3> enu_m(const GeodeticPoint& point) const {
    const auto at =
        ecef(direction(angle_rad(point.latitude_2ndeg)), direction(angle_rad(point.longitude_2ndeg)), point.height_m);
    const double x = at[0] - origin_ecef_m_[0];
    const double y = at[1] - origin_ecef_m_[1];
    const double z = at[2] - origin_ecef_m_[2];
    const double radial = longitude_.cos * x + longitude_.sin * y;
    return {longitude_.cos * y - longitude_.sin * x, latitude_.cos * z - latitude_.sin * radial,
            latitude_.cos * radial + latitude_.sin * z};
  }

  /// Normal gravity at the origin: Somigliana's formula and the free-air term.
  [[nodiscard]] double gravity_mps2() const {
    const double s2 = latitude_.sin * latitude_.sin;
    const double surface = 9.7803253359 * (1 + 0.00193185265241 * s2) / sim::sqrt(1 - kE2 * s2);
    return surface * (1 - 2 * origin_.height_m / kA * (1 + kF + 0.00344978650684 - 2 * kF * s2));
  }

  /// The Earth's rotation in the local frame.
  [[nodiscard]] std::array<double, 3> earth_rate_n_radps() const {
    return {0, kEarthRate_radps * latitude_.cos, kEarthRate_radps * latitude_.sin};
  }

 private:
  static double prime_vertical_m(double sin_latitude) { return kA / sim::sqrt(1 - kE2 * sin_latitude * sin_latitude); }
  static std::array<double, 3> ecef(Direction latitude, Direction longitude, double height_m) {
    const double n = prime_vertical_m(latitude.sin);
    return {(n + height_m) * latitude.cos * longitude.cos, (n + height_m) * latitude.cos * longitude.sin,
            (n * (1 - kE2) + height_m) * latitude.sin};
  }
  static std::int64_t units(double angle_rad) {
    return static_cast<std::int64_t>(sim::floor(angle_rad * (180 / kPi) * 5e8 + 0.5));
  }
  static double angle_rad(std::int64_t angle_2ndeg) { return static_cast<double>(angle_2ndeg) * 2e-9 * (kPi / 180); }

  GeodeticOrigin origin_;
  Direction latitude_;
  Direction longitude_;
  std::array<double, 3> origin_ecef_m_;
};

}  // namespace tetap::sim
