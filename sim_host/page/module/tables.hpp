// SPDX-License-Identifier: Apache-2.0
// Tables of sensors (CSV) that the page holds: what their columns are, and the log that they make.
#pragma once

#include "sim_host/csv/import.hpp"
#include "sim_host/replay/result.hpp"

#include <cstdint>
#include <list>
#include <string>
#include <vector>

namespace tetap::page {

class SensorTables {
 public:
  /// A text of so many bytes, for the page to fill.
  char* room(std::uint32_t size) { return texts_.emplace_back(size, '\0').data(); }
  // Each takes the last two texts.
  sim::Result<> add_file();    ///< its name, its content
  sim::Result<> add_column();  ///< quantity, column
  sim::Result<> add_unit();    ///< quantity, unit

  /// JSON: {"files": [{"name", "columns", "bound": [{"quantity", "column", "unit", "stated"}], "wrong"}],
  /// "quantities"}.
  [[nodiscard]] std::string columns() const;
  /// Writes the log in blocks, and what was read as kImported.
  sim::Result<> import(std::uint32_t base);

 private:
  /// Two texts that belong to no file.
  [[nodiscard]] bool two() const { return texts_.size() >= 2 * files_.size() + 2; }
  csv::Named named();

  std::list<std::string> texts_;  // a text stays where it is
  std::vector<csv::File> files_;
  csv::Options options_{.columns = {}, .units = {}, .base = 0x300, .interface = "csv"};
};

}  // namespace tetap::page
