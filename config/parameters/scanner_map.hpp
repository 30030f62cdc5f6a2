// SPDX-License-Identifier: Apache-2.0
// Parameters of the robot scanner_map (config/scanner_map.hpp).
#pragma once

#include "config/parameters/scanner.hpp"
#include "tetap/param/limits.hpp"

namespace tetap::robot::scanner_map {

inline constexpr param::Parameters parameters = param::checked([] {
  param::Parameters n = scanner::parameters;
  n.mapping.publish_every = 2;
  return n;
}());

}  // namespace tetap::robot::scanner_map
