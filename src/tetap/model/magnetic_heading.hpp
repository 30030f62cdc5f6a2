// SPDX-License-Identifier: Apache-2.0
// The field a magnetometer shows points to magnetic north: its horizontal direction only, so that neither strength nor
// dip of the field need be known. A wrong tilt turns the dipping field, and H contains that.
#pragma once

#include "tetap/model/direction.hpp"

namespace tetap::model {

struct MagneticHeading : DirectionMeasurement {
  /// `field_b` calibrated, any unit; `declination_rad` of magnetic north from true north, east positive.
  MagneticHeading(const nav::Vector3& field_b, float declination_rad, float sigma)
      : DirectionMeasurement{.vector_b = field_b, .angle_rad = base::kHalfPi - declination_rad, .sigma_rad = sigma} {}
};

}  // namespace tetap::model
