// SPDX-License-Identifier: Apache-2.0
// Likelihood fields for tests: of walls, by the distance to each segment in double, and of a file of make_field.
#pragma once

#include "support/scan_room.hpp"
#include "tetap/slam/likelihood_field.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>
#include <vector>

namespace tetap::test {

/// A field with what it is a view of.
struct OwnField {
  std::vector<std::uint8_t> index, tiles;
  slam::LikelihoodField field;
  void bind() { field.index = index, field.tiles = tiles; }
};

[[nodiscard]] inline double distance_to(const Wall& w, double x, double y) {
  const double ex = w.x1 - w.x0, ey = w.y1 - w.y0;
  const double part = std::clamp(((x - w.x0) * ex + (y - w.y0) * ey) / (ex * ex + ey * ey), 0.0, 1.0);
  return std::hypot(w.x0 + part * ex - x, w.y0 + part * ey - y);
}
/// Every tile is kept.
inline void make_field(const std::vector<Wall>& walls, double cell_m, double low_x, double low_y, int columns, int rows,
                       OwnField& own) {
  own = {};
  for (int t = 0; t < columns * rows; ++t) {
    own.index.push_back(static_cast<std::uint8_t>(t + 1));
    for (int i = 0; i < 256; i += 2) {
      int both = 0;
      for (int half = 0; half < 2; ++half) {
        const double x = low_x + cell_m * (16 * (t % columns) + (i + half) % 16 + 0.5);
        const double y = low_y + cell_m * (16 * (t / columns) + (i + half) / 16 + 0.5);
        double least = 1e9;
        for (const Wall& w : walls) least = std::min(least, distance_to(w, x, y));
        both |= std::min(slam::LikelihoodField::kFar, static_cast<int>(std::lround(least / (0.5 * cell_m))))
                << 4 * half;
      }
      own.tiles.push_back(static_cast<std::uint8_t>(both));
    }
  }
  own.field = {.cell_m = static_cast<float>(cell_m),
               .step_m = static_cast<float>(0.5 * cell_m),
               .low_x_m = static_cast<float>(low_x),
               .low_y_m = static_cast<float>(low_y),
               .columns = columns,
               .rows = rows};
  own.bind();
}
/// The bytes of tools/dataset/make_field; false where they are none.
[[nodiscard]] inline bool read_field(const std::string& path, OwnField& own) {
  std::ifstream file(path, std::ios::binary);
  std::string line;
  if (!std::getline(file, line)) return false;
  std::istringstream words(line);
  int tiles = 0;
  slam::LikelihoodField& f = own.field;
  if (!(words >> f.cell_m >> f.step_m >> f.low_x_m >> f.low_y_m >> f.columns >> f.rows >> tiles)) return false;
  const std::vector<char> bytes{std::istreambuf_iterator<char>(file), {}};
  const auto split = static_cast<std::size_t>(f.columns) * static_cast<std::size_t>(f.rows);
  if (bytes.size() != split + static_cast<std::size_t>(tiles) * f.kTileBytes) return false;
  own.index.assign(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(split));
  own.tiles.assign(bytes.begin() + static_cast<std::ptrdiff_t>(split), bytes.end());
  own.bind();
  return f.valid();
}

}  // namespace tetap::test
