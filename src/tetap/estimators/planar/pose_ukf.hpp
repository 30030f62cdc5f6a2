// SPDX-License-Identifier: Apache-2.0
// The planar pose by unscented Kalman filter, with P or with a triangular root of it.
#pragma once

#include "tetap/estimators/planar/pose_filter.hpp"
#include "tetap/filter/ukf.hpp"
#include "tetap/filter/ukf_sqrt.hpp"

namespace tetap::estimators {

using PoseUkf = PoseFilter<filter::Ukf<model::PlanarPose>>;
using PoseUkfSqrt = PoseFilter<filter::UkfSqrt<model::PlanarPose>>;

}  // namespace tetap::estimators
