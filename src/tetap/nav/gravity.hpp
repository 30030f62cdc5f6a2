// SPDX-License-Identifier: Apache-2.0
// Normal gravity on and above the WGS84 ellipsoid, and the Earth's rotation (NIMA TR8350.2, eq. 4-1 and 4-3, table 3.1
// and 3.4). Computed once, when the origin is known.
#pragma once

#include "tetap/base/wgs84.hpp"
#include "tetap/nav/geodesy.hpp"
#include "tetap/nav/so3.hpp"

namespace tetap::nav {

/// m/s^2 downwards; height above the ellipsoid. Within 1e-6 m/s^2 of the closed form up to 20 km.
[[nodiscard]] constexpr double normal_gravity(double latitude_rad, double height_m) {
  constexpr double kEquator_mps2 = 9.7803253359;
  constexpr double kSomigliana = 0.00193185265241;
  constexpr double kCentrifugal = 0.00344978650684;  // omega^2 a^2 b / GM
  const double s = base::sin(latitude_rad);
  const double s2 = s * s;
  const double surface = kEquator_mps2 * (1.0 + kSomigliana * s2) / base::sqrt(1.0 - base::kEccentricity2 * s2);
  const double up = height_m / base::kSemiMajor_m;
  return surface *
         (1.0 - 2.0 * (1.0 + base::kFlattening + kCentrifugal - 2.0 * base::kFlattening * s2) * up + 3.0 * up * up);
}

/// Effect of the Earth on a body at rest on it, along the map's axes. The map is fixed to the Earth, so its rotation is
/// the same everywhere, and there is no transport rate. Gravity is that of the place.
struct Earth {
  float gravity_mps2 = 9.80665F;           ///< at the place
  Vector3 rate_n_radps = Vector3::Zero();  ///< zero: not modelled
  Vector3 up_n{0.0F, 0.0F, 1.0F};          ///< plumb line of the place
  float origin_gravity_mps2 = 9.80665F;

  /// At the origin.
  [[nodiscard]] static Earth at(const LocalFrame& origin, bool with_rotation) {
    constexpr double kRate_radps = 7.292115e-5;
    const double latitude = static_cast<double>(origin.latitude_2ndeg()) * base::kRadPer2ndeg;
    Earth earth;
    earth.gravity_mps2 = earth.origin_gravity_mps2 =
        static_cast<float>(normal_gravity(latitude, static_cast<double>(origin.height_m())));
    if (with_rotation) {
      const base::SinCosDouble at = base::sincos(latitude);
      earth.rate_n_radps = {0.0F, static_cast<float>(kRate_radps * at.cos), static_cast<float>(kRate_radps * at.sin)};
    }
    return earth;
  }
  /// Moves to a place. Normal gravity is linearised in the squared sine of the latitude and the height: within 2e-5
  /// m/s^2 over 105 km and 2 km of height.
  void move_to(const LocalLevel& place, const Curvature& origin) {
    constexpr float kLatitude_mps2 = 0.05186F, kFreeAir_per_s2 = 3.086e-6F;
    up_n = place.up_n;
    const float rise = origin.axis_north * up_n(1) + origin.axis_up * (up_n(2) - 1.0F);  // sine here minus there
    gravity_mps2 =
        origin_gravity_mps2 + kLatitude_mps2 * rise * (2.0F * origin.axis_up + rise) - kFreeAir_per_s2 * place.height_m;
  }
  [[nodiscard]] bool rotates() const { return rate_n_radps.squaredNorm() > 0.0F; }
};

}  // namespace tetap::nav
