// SPDX-License-Identifier: Apache-2.0
// The planar pose by extended Kalman filter, for a robot that gets displacements between stamps from elsewhere.
#pragma once

#include "tetap/estimators/planar/cloning_ekf.hpp"
#include "tetap/estimators/planar/pose_filter.hpp"

namespace tetap::estimators {

using CloningPoseEkf = PoseFilter<CloningEkf>;

}  // namespace tetap::estimators
