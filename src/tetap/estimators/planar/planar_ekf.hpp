// SPDX-License-Identifier: Apache-2.0
// The extended Kalman filter of the planar pose, whose motion and measurements declare their structure by type.
#pragma once

#include "tetap/filter/structured_kalman.hpp"
#include "tetap/filter/viewed.hpp"
#include "tetap/model/planar_pose.hpp"

namespace tetap::estimators {

using PlanarEkf = filter::Viewable<filter::StructuredKalman<model::PlanarPose, filter::Guard::kConditioned>>;

}  // namespace tetap::estimators
