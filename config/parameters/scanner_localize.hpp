// SPDX-License-Identifier: Apache-2.0
// Parameters of the robot scanner_localize (config/scanner_localize.hpp).
#pragma once

#include "config/parameters/scanner.hpp"
#include "tetap/param/limits.hpp"

namespace tetap::robot::scanner_localize {

inline constexpr param::Parameters parameters = scanner::parameters;

}  // namespace tetap::robot::scanner_localize
