// SPDX-License-Identifier: Apache-2.0
// A mistake that was found: its code, the comparison with its figures, and what to change.
#pragma once

#include "sim_host/doctor/codes.hpp"

#include <cstdarg>
#include <cstdio>
#include <optional>
#include <string>
#include <vector>

namespace tetap::doctor {

/// A row of the parameter table and its values.
struct Setting {
  std::string_view path;
  std::vector<double> values;
};
using Remedy = std::vector<Setting>;

struct Finding {
  Code code;
  Devices uses = 0;      ///< devices whose data the comparison took for right
  double certainty = 1;  ///< 0 to 1: orders findings of one code, and codes that one comparison cannot part
  std::string evidence;
  std::string change;            ///< empty: as the table has it
  Devices spoils = 0;            ///< 0: as the table has it
  std::optional<Code> beside{};  ///< the same comparison fits that code as well: the two are named one after the other
  std::vector<Remedy> remedies{};  ///< each whole; several where the log shows no single one
};
using Findings = std::vector<Finding>;

/// As printf, into a string.
[[gnu::format(printf, 1, 2)]] [[nodiscard]] inline std::string text(const char* format, ...) {
  char line[512];
  std::va_list values;
  va_start(values, format);
  std::vsnprintf(line, sizeof line, format, values);
  va_end(values);
  return line;
}

}  // namespace tetap::doctor
