// SPDX-License-Identifier: Apache-2.0
// Heading of the line between two antennas, as a receiver with moving base reports it.
#pragma once

#include "tetap/model/direction.hpp"

namespace tetap::model {

struct DualHeading : DirectionMeasurement {
  /// `baseline_b_m` from the first antenna to the second, `heading_rad` of that line (from east, counter-clockwise).
  DualHeading(const nav::Vector3& baseline_b_m, float heading_rad, float sigma)
      : DirectionMeasurement{.vector_b = baseline_b_m, .angle_rad = heading_rad, .sigma_rad = sigma} {}
};

}  // namespace tetap::model
