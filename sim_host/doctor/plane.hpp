// SPDX-License-Identifier: Apache-2.0
// Fixes on the level plane of the first one, on a round Earth: enough to compare axes.
#pragma once

#include "tetap/sensor/samples.hpp"

namespace tetap::doctor {

inline constexpr double kEarth_m =
    6371008.8;  ///< mean radius (Moritz 2000, J. Geodesy 74, "Geodetic Reference System 1980")

/// A fix on the plane of the first one.
struct PlanePoint {
  double east_m = 0, north_m = 0, up_m = 0;
};

/// The plane of the first fix.
class Plane {
 public:
  [[nodiscard]] PlanePoint at(const sensor::GnssPosition& fix);
  [[nodiscard]] double latitude_rad() const { return latitude_rad_; }
  [[nodiscard]] double longitude_rad() const { return longitude_rad_; }
  [[nodiscard]] bool known() const { return known_; }

 private:
  bool known_ = false;
  double latitude_rad_ = 0, longitude_rad_ = 0, height_m_ = 0;
};

}  // namespace tetap::doctor
