// SPDX-License-Identifier: Apache-2.0
// Parameters of the robot mapper_fast (config/mapper_fast.hpp).
#pragma once

#include "config/parameters/mapper.hpp"
#include "tetap/param/limits.hpp"

namespace tetap::robot::mapper_fast {

inline constexpr param::Parameters parameters = param::checked([] {
  param::Parameters n = mapper::parameters;
  n.mapping = {.resample_share = 0.5F};
  return n;
}());

}  // namespace tetap::robot::mapper_fast
