// SPDX-License-Identifier: Apache-2.0
// The rover of rover.hpp on the plane: wheels and gyroscope, a camera that knows landmarks, and GNSS, in an EKF of
// three states.
#pragma once

#include "config/parameters/rover_landmarks.hpp"
#include "tetap/estimators/odometry.hpp"
#include "tetap/estimators/planar/pose_ekf.hpp"
#include "tetap/node/node.hpp"

namespace tetap::robot::rover_landmarks {

using Estimators = node::Estimators<estimators::Odometry, estimators::PoseEkf>;

}  // namespace tetap::robot::rover_landmarks
