// SPDX-License-Identifier: Apache-2.0
// The robots of config/mrclam.hpp without a map: EKF-SLAM makes one of up to thirty landmarks. The numbers are those
// of docs/explanation/ekf_slam.md, found on the five robots of Dataset 7 together, leaving one out in turn.
#pragma once

#include "config/parameters/mrclam_slam.hpp"
#include "tetap/estimators/mapping/planar_mapper.hpp"
#include "tetap/estimators/odometry.hpp"
#include "tetap/node/node.hpp"

namespace tetap::robot::mrclam_slam {

using Estimators = node::Estimators<estimators::Odometry, estimators::EkfSlam30>;

}  // namespace tetap::robot::mrclam_slam
