// SPDX-License-Identifier: Apache-2.0
// The robot of config/mapper.hpp with FastSLAM 2: a hundred particles of up to fifteen landmarks, which name
// themselves.
#pragma once

#include "config/parameters/mapper_fast.hpp"
#include "tetap/estimators/mapping/planar_mapper.hpp"
#include "tetap/estimators/odometry.hpp"
#include "tetap/node/node.hpp"

namespace tetap::robot::mapper_fast {

using Estimators = node::Estimators<estimators::Odometry, estimators::FastSlam100>;

}  // namespace tetap::robot::mapper_fast
