// SPDX-License-Identifier: Apache-2.0
// Folder of recorded data ($TETAP_DATA, else TETAP_DEFAULT_DATA, a definition of the build), and their tables of
// numbers.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

namespace tetap::test {

/// The folder of a recorded set; empty where it is not there.
[[nodiscard]] inline std::string recorded_folder(const std::string& set) {
  const char* const given = std::getenv("TETAP_DATA");
  const std::filesystem::path data = given != nullptr ? given : TETAP_DEFAULT_DATA;
  return std::filesystem::is_directory(data / set) ? (data / set).string() : std::string();
}

using Row = std::vector<double>;
/// The numbers of each line; empty lines and lines that begin with # are left out.
[[nodiscard]] inline std::vector<Row> read_rows(const std::string& path) {
  std::vector<Row> rows;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    if (line.empty() || line[0] == '#') continue;
    std::istringstream words(line);
    Row row;
    for (double value = 0; words >> value;) row.push_back(value);
    if (!row.empty()) rows.push_back(row);
  }
  return rows;
}

}  // namespace tetap::test
