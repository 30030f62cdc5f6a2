// SPDX-License-Identifier: Apache-2.0
// The WGS-84 ellipsoid in closed form (NIMA TR8350.2, 3rd ed.), with the world's own arithmetic: the same bits with
// every C library. It shares nothing with the firmware; GeographicLib judges it in the tests.
#pragma once

#include "sim_host/world/rotation.hpp"

namespace tetap::sim {

struct GeodeticOrigin {
  double latitude_deg = 0;
  double longitude_deg = 0;
  double height_m = 0;  ///< above the ellipsoid
};

namespace wgs84 {

inline constexpr double kA_m = 6378137;
inline constexpr double kF = 1 / 298.257223563;
inline constexpr double kE2 = kF * (2 - kF);
inline constexpr double kRate_radps = 7292115e-11;
inline constexpr double kGm_m3ps2 = 3986004.418e8;

/// Geocentric position of a place, axes to Greenwich, 90 deg east and the north pole.
[[nodiscard]] Vector3 geocentric(const GeodeticOrigin& place);
/// The place of a geocentric position that is not near the centre (Bowring, Survey Review 23, 1976).
[[nodiscard]] GeodeticOrigin geodetic(const Vector3& p_e_m);
/// Rotation from east, north, up of a place into the geocentric axes.
[[nodiscard]] Matrix3 axes(const GeodeticOrigin& place);
/// Normal gravity at a geocentric position, centrifugal force included (Heiskanen and Moritz, Physical Geodesy, 1967,
/// 2-7 and 2-8).
[[nodiscard]] Vector3 gravity(const Vector3& p_e_m);

}  // namespace wgs84

}  // namespace tetap::sim
