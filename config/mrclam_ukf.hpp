// SPDX-License-Identifier: Apache-2.0
// The robots of config/mrclam.hpp, with the same numbers, and an unscented filter in the place of the extended one.
#pragma once

#include "config/mrclam.hpp"
#include "estimators/planar/pose_ukf.hpp"

namespace tetap::robot::mrclam_ukf {

using Estimators = node::Estimators<estimators::Odometry, estimators::PoseUkf>;

inline constexpr param::Parameters parameters = mrclam::parameters;

}  // namespace tetap::robot::mrclam_ukf
