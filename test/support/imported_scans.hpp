// SPDX-License-Identifier: Apache-2.0
// Recorded scans with relations or true poses, by tools/dataset/import_scans below TETAP_SOURCE.
#pragma once

#include "support/recorded.hpp"

#include <gtest/gtest.h>
#include <cstdlib>
#include <filesystem>
#include <string>

namespace tetap::test {

/// Files of the importer, without their endings; empty where the set is not there. `option` is --relations or --truth.
[[nodiscard]] inline std::string imported_scans(const std::string& scans, const std::string& option,
                                                const std::string& judge) {
  const std::string folder = recorded_folder("scans");
  if (folder.empty() || !std::filesystem::exists(folder + "/" + scans)) return {};
  const std::string out = testing::TempDir() + "tetap_" + scans;
  const std::string command = std::string("'" TETAP_SOURCE "/tools/dataset/import_scans' '") + folder + "/" + scans +
                              "' '" + out + "' " + option + " '" + folder + "/" + judge + "' > /dev/null";
  return std::system(command.c_str()) == 0 ? out : "failed: " + command;
}

}  // namespace tetap::test
