// SPDX-License-Identifier: Apache-2.0
// Parameters of the robot mrclam_pf (config/mrclam_pf.hpp).
#pragma once

#include "config/parameters/mrclam.hpp"
#include "tetap/param/limits.hpp"

namespace tetap::robot::mrclam_pf {

inline constexpr param::Parameters parameters = param::checked([] {
  param::Parameters n = mrclam::parameters;
  n.landmark.sigma_range_m = 0.05F;
  n.landmark.sigma_range_per_m = 0.025F;
  n.landmark.sigma_bearing_rad = 0.04F;
  return n;
}());

}  // namespace tetap::robot::mrclam_pf
