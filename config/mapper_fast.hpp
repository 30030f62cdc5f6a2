// SPDX-License-Identifier: Apache-2.0
// The robot of config/mapper.hpp with FastSLAM 2: a hundred particles of up to fifteen landmarks, which name
// themselves.
#pragma once

#include "config/mapper.hpp"

namespace tetap::robot::mapper_fast {

using Estimators = node::Estimators<estimators::Odometry, estimators::FastSlam100>;

inline constexpr param::Parameters parameters = param::checked([] {
  param::Parameters n = mapper::parameters;
  n.mapping = {.resample_share = 0.5F};
  return n;
}());

}  // namespace tetap::robot::mapper_fast
