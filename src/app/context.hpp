// SPDX-License-Identifier: Apache-2.0
// What every estimator is given with a sample, and the commands it can be sent.
#pragma once

#include "app/numbers.hpp"
#include "app/site.hpp"
#include "base/time.hpp"
#include "model/planar_pose.hpp"

namespace tetap::app {

struct Context {
  const Numbers& numbers;
  const Site& site;
};

/// A pose from outside. sigma_yaw_rad >= pi (or not available on the bus): the heading is not known.
struct SetPose {
  model::PlanarPose pose;
  float sigma_position_m = 0;
  float sigma_yaw_rad = 0;
  std::uint8_t counter = 0;  ///< of the command it came with
};

}  // namespace tetap::app
