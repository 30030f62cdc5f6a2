// SPDX-License-Identifier: Apache-2.0
// The electronic data sheet (CiA 306) of a node that speaks SDO.
#pragma once

#include "tetap/param/parameters.hpp"

#include <string>

namespace tetap::sim {

/// A file of all objects with the robot's values as defaults, without the key. Limits are given of whole numbers alone:
/// readers of such files take no others. The node judges all.
[[nodiscard]] std::string electronic_data_sheet(const std::string& robot, const param::Parameters& compiled);

}  // namespace tetap::sim
