// SPDX-License-Identifier: Apache-2.0
// The robots that are in this module. CMake writes the list.
#pragma once

#include "sim_host/robot.hpp"

#include <span>

namespace tetap::page {

[[nodiscard]] std::span<const sim::Robot* const> robots();

}  // namespace tetap::page
