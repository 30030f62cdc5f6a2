// SPDX-License-Identifier: Apache-2.0
// A rover that maps landmarks without identities: wheels, a gyroscope and a camera, EKF-SLAM of thirty landmarks. The
// simulated world has landmarks on both sides of its way, clutter and moving obstacles for it.
#pragma once

#include "config/parameters/mapper.hpp"
#include "tetap/estimators/mapping/planar_mapper.hpp"
#include "tetap/estimators/odometry.hpp"
#include "tetap/node/node.hpp"

namespace tetap::robot::mapper {

using Estimators = node::Estimators<estimators::Odometry, estimators::EkfSlam30>;

}  // namespace tetap::robot::mapper
