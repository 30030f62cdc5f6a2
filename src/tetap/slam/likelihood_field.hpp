// SPDX-License-Identifier: Apache-2.0
// A given map for a scanner: the distance to the nearest wall in each cell, in 4 bits, in tiles (Thrun, Burgard, Fox
// 2005, sec. 6.4). What the map never saw has a level of its own. Tiles far from all walls take one byte.
// tools/dataset/make_field makes it of a PGM and YAML map.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace tetap::slam {

/// A view: the robot's own data, or what was loaded before the node began. Frame: that of the map, in m.
struct LikelihoodField {
  static constexpr int kTile = 16;                        ///< cells on a side of a tile
  static constexpr std::size_t kTileBytes = 16 * 16 / 2;  ///< by rows, the lower half of a byte first
  static constexpr std::uint8_t kEmpty = 0;               ///< in the index: free space, no wall is near
  static constexpr std::uint8_t kUnseen = 255;            ///< in the index: the map never saw it, no wall is near
  static constexpr int kFar = 14;                         ///< level of a free cell without a wall near
  static constexpr int kUnknown = 15;                     ///< level of a cell that the map never saw
  static constexpr int kLevels = 16;
  static constexpr std::size_t kMostBytes = 32 * 1024;

  float cell_m = 0;                     ///< side of a cell; 0: no map
  float step_m = 0;                     ///< distance from one level to the next
  float low_x_m = 0, low_y_m = 0;       ///< corner of the first cell
  int columns = 0, rows = 0;            ///< in tiles
  std::span<const std::uint8_t> index;  ///< number of a tile from 1, by rows from below; kEmpty, kUnseen
  std::span<const std::uint8_t> tiles;

  [[nodiscard]] constexpr std::uint8_t tile(int column, int row) const {
    const int place = row * columns + column;
    return index[static_cast<std::size_t>(place)];
  }
  /// Level of a cell, 0 in a wall; kUnknown outside of the map.
  [[nodiscard]] constexpr int level(int x, int y) const {
    if (x < 0 || y < 0 || x >= columns * kTile || y >= rows * kTile) return kUnknown;
    const std::uint8_t number = tile(x / kTile, y / kTile);
    if (number == kEmpty) return kFar;
    if (number == kUnseen) return kUnknown;
    const int place = y % kTile * kTile + x % kTile;
    const std::uint8_t both = tiles[(number - 1U) * kTileBytes + static_cast<std::size_t>(place / 2)];
    return place % 2 == 0 ? both & 15 : both >> 4;
  }
  /// Sizes fit each other, and each number of the index has its tile.
  [[nodiscard]] constexpr bool valid() const {
    const bool sizes = cell_m > 0.01F && cell_m < 2.0F && step_m > 0.0F && step_m < 2.0F && columns > 0 && rows > 0 &&
                       columns <= 512 && rows <= 512 &&
                       index.size() == static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows) &&
                       tiles.size() % kTileBytes == 0 && index.size() + tiles.size() <= kMostBytes;
    if (!sizes) return false;
    for (const std::uint8_t number : index)
      if (number != kUnseen && number > tiles.size() / kTileBytes) return false;
    return true;
  }
};

}  // namespace tetap::slam
