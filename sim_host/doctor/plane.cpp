// SPDX-License-Identifier: Apache-2.0
#include "sim_host/doctor/plane.hpp"

#include "tetap/base/wgs84.hpp"

#include <cmath>
#include <numbers>

namespace tetap::doctor {

PlanePoint Plane::at(const sensor::GnssPosition& fix) {
  const double latitude = static_cast<double>(fix.latitude_2ndeg) * base::kRadPer2ndeg;
  const double longitude = static_cast<double>(fix.longitude_2ndeg) * base::kRadPer2ndeg;
  const double height = std::isfinite(fix.height_m) ? static_cast<double>(fix.height_m) : 0;
  if (!known_) latitude_rad_ = latitude, longitude_rad_ = longitude, height_m_ = height, known_ = true;
  return {
      .east_m = kEarth_m * std::cos(latitude_rad_) * std::remainder(longitude - longitude_rad_, 2 * std::numbers::pi),
      .north_m = kEarth_m * (latitude - latitude_rad_),
      .up_m = height - height_m_};
}

}  // namespace tetap::doctor
