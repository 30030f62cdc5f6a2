// SPDX-License-Identifier: Apache-2.0
// What the page knows of the module: robots with their parameters, the table of parameters, the doctor's codes.
#pragma once

#include <string>

namespace tetap::page {

[[nodiscard]] std::string description();

}  // namespace tetap::page
