// SPDX-License-Identifier: Apache-2.0
// The robots of config/mrclam.hpp without a map: FastSLAM 2 with a hundred particles of up to fifteen landmarks. Motion
// and camera are those of config/mrclam_slam.hpp; the other numbers were chosen on the five robots together
// (docs/explanation/fast_slam.md).
#pragma once

#include "config/parameters/mrclam_fast.hpp"
#include "tetap/estimators/mapping/planar_mapper.hpp"
#include "tetap/estimators/odometry.hpp"
#include "tetap/node/node.hpp"

namespace tetap::robot::mrclam_fast {

using Estimators = node::Estimators<estimators::Odometry, estimators::FastSlam100>;

}  // namespace tetap::robot::mrclam_fast
