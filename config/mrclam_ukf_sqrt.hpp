// SPDX-License-Identifier: Apache-2.0
// The robots of config/mrclam.hpp, with the same numbers, and a square-root unscented filter in the place of the
// extended one.
#pragma once

#include "config/parameters/mrclam_ukf_sqrt.hpp"
#include "tetap/estimators/odometry.hpp"
#include "tetap/estimators/planar/pose_ukf.hpp"
#include "tetap/node/node.hpp"

namespace tetap::robot::mrclam_ukf_sqrt {

using Estimators = node::Estimators<estimators::Odometry, estimators::PoseUkfSqrt>;

}  // namespace tetap::robot::mrclam_ukf_sqrt
