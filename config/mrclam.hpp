// SPDX-License-Identifier: Apache-2.0
// The five robots of the UTIAS MRCLAM data sets (Leung, Halpern, Barfoot, Liu, IJRR 2011): iRobot Create, commanded
// speeds at 67 Hz, landmarks by a camera's barcodes, map and start pose given on the bus. One configuration for all
// robots.
//
// How the numbers were found: by the likelihood of the innovations over the five robots of Dataset 7 (sum of NIS and
// log det S, NIS capped at 20), not by the distance to the truth; rounded to one digit.
#pragma once

#include "config/parameters/mrclam.hpp"
#include "tetap/estimators/odometry.hpp"
#include "tetap/estimators/planar/pose_ekf.hpp"
#include "tetap/node/node.hpp"

namespace tetap::robot::mrclam {

using Estimators =
    node::WithBusParameters<node::WithBusProtection<node::Estimators<estimators::Odometry, estimators::PoseEkf>>>;

}  // namespace tetap::robot::mrclam
