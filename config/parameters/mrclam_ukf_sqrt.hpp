// SPDX-License-Identifier: Apache-2.0
// Parameters of the robot mrclam_ukf_sqrt (config/mrclam_ukf_sqrt.hpp).
#pragma once

#include "config/parameters/mrclam.hpp"

namespace tetap::robot::mrclam_ukf_sqrt {

inline constexpr param::Parameters parameters = mrclam::parameters;

}  // namespace tetap::robot::mrclam_ukf_sqrt
