// SPDX-License-Identifier: Apache-2.0
// The planar pose by extended Kalman filter.
#pragma once

#include "tetap/estimators/planar/pose_filter.hpp"

namespace tetap::estimators {

using PoseEkf = PoseFilter<PlanarEkf>;

}  // namespace tetap::estimators
