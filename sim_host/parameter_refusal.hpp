// SPDX-License-Identifier: Apache-2.0
// Why a parameter's row refuses a value, as one sentence for people.
#pragma once

#include "tetap/param/table.hpp"

#include <cmath>
#include <cstdio>
#include <string>

namespace tetap::sim {

/// With up to seven digits.
[[nodiscard]] inline std::string plain(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.7g", value);
  return text;
}

/// "path is 420 m; it has to be ".
[[nodiscard]] inline std::string refused(const param::Row& row, double value) {
  const std::string unit = row.unit;
  return std::string(row.path) + " is " + plain(value) + (unit.empty() ? "" : " " + unit) + "; it has to be ";
}

/// Empty where the row takes the value.
[[nodiscard]] inline std::string refusal_of(const param::Row& row, double value) {
  if (!param::within(row, value))
    return refused(row, value) + "from " + plain(row.minimum) + " to " + plain(row.maximum);
  if (row.storage == param::Storage::kWhole && std::abs(value - std::trunc(value)) > 0)
    return refused(row, value) + "a whole number";
  return {};
}

}  // namespace tetap::sim
