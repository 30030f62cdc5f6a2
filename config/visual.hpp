// SPDX-License-Identifier: Apache-2.0
// The rover with a camera that looks ahead, in the memory class of 64 kB: features of the latest six images, wheels and
// a gyroscope. Numbers of another camera are parameters (tools/dataset/import_kitti_klt writes those of KITTI's).
#pragma once

#include "config/parameters/visual.hpp"
#include "tetap/estimators/odometry.hpp"
#include "tetap/estimators/visual/visual_odometry.hpp"
#include "tetap/node/node.hpp"

namespace tetap::robot::visual {

using Estimators = node::Estimators<estimators::Odometry, estimators::VisualOdometry6>;

}  // namespace tetap::robot::visual
