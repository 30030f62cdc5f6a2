// SPDX-License-Identifier: Apache-2.0
// Data association of sightings and landmarks: nearest neighbour, and the assignment of least total cost (Kuhn 1955;
// shortest augmenting paths: Jonker & Volgenant, Computing 38, 1987). Costs are integers, so that sums are exact and
// equal costs are ordered by index alone: the same answer on every target.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace tetap::slam {

/// A squared distance in steps of 1/16, rounded down; nothing below zero, kForbidden for NaN and above 2^20.
inline constexpr std::int32_t kForbidden = 1 << 24;
[[nodiscard]] constexpr std::int32_t association_cost(float squared_distance) {
  if (!(squared_distance < 1'048'576.0F)) return kForbidden;
  return squared_distance > 0.0F ? static_cast<std::int32_t>(squared_distance * 16.0F) : 0;
}

/// Costs of up to kRows sightings against up to kColumns landmarks. A pair at or above the gate is never made.
template <int kRows, int kColumns>
class Association {
  static_assert(kRows > 0 && kColumns > 0 && kRows + kColumns < 0x7fff);

 public:
  static constexpr int kNone = -1;
  using Result = std::array<int, kRows>;  ///< landmark of each sighting, or kNone

  /// All pairs are forbidden until they are set. rows <= kRows, columns <= kColumns.
  void begin(int rows, int columns, std::int32_t gate) {
    rows_ = rows;
    columns_ = columns;
    gate_ = gate < kForbidden ? gate : kForbidden;
    for (int r = 0; r < rows; ++r)
      for (int c = 0; c < columns; ++c) cost_[at(r)][at(c)] = kForbidden;
  }
  void set(int row, int column, std::int32_t cost) { cost_[at(row)][at(column)] = cost; }

  /// Each sighting by itself: the least cost below the gate, the first of equals. Two may get the same landmark.
  [[nodiscard]] Result nearest() const {
    Result result{};
    for (int r = 0; r < rows_; ++r) {
      std::int32_t least = gate_;
      result[at(r)] = kNone;
      for (int c = 0; c < columns_; ++c)
        if (cost_[at(r)][at(c)] < least) least = cost_[at(r)][at(c)], result[at(r)] = c;
    }
    return result;
  }

  /// No landmark twice; the sum of costs is least, where a sighting without a landmark costs the gate.
  [[nodiscard]] Result assign() {
    row_of_.fill(kNone);
    potential_.fill(0);
    row_potential_.fill(0);
    for (int r = 0; r < rows_; ++r) augment(r);
    Result result{};
    result.fill(kNone);
    for (int c = 0; c < columns_; ++c)
      if (row_of_[at(c)] != kNone && pair_cost(row_of_[at(c)], c) < gate_) result[at(row_of_[at(c)])] = c;
    return result;
  }

 private:
  static constexpr int kAll = kColumns + kRows;  ///< each sighting has a column of its own: no landmark
  static constexpr std::size_t at(int i) { return static_cast<std::size_t>(i); }

  [[nodiscard]] int all() const { return columns_ + rows_; }
  [[nodiscard]] std::int64_t pair_cost(int row, int column) const {
    if (column >= columns_) return column - columns_ == row ? gate_ : kForbidden;
    const std::int32_t cost = cost_[at(row)][at(column)];
    return cost < gate_ ? cost : kForbidden;
  }

  /// One more sighting: the cheapest path from it to a free column, by Dijkstra on reduced costs.
  void augment(int row) {
    constexpr std::int64_t kFar = std::int64_t{1} << 60;
    std::array<std::int64_t, kAll> distance;
    std::array<int, kAll> before;
    std::array<bool, kAll> done{};
    distance.fill(kFar);
    before.fill(kNone);
    int current = row, column = kNone;
    std::int64_t reached = 0;
    for (int step = 0; step < all(); ++step) {
      std::int64_t least = kFar;
      int next = kNone;
      for (int c = 0; c < all(); ++c) {
        if (done[at(c)]) continue;
        const std::int64_t way = reached + pair_cost(current, c) - row_potential_[at(current)] - potential_[at(c)];
        if (way < distance[at(c)]) distance[at(c)] = way, before[at(c)] = column;
        if (distance[at(c)] < least) least = distance[at(c)], next = c;
      }
      column = next;
      reached = least;
      if (row_of_[at(column)] == kNone) break;
      done[at(column)] = true;
      current = row_of_[at(column)];
    }
    row_potential_[at(row)] += reached;
    for (int c = 0; c < all(); ++c) {
      if (!done[at(c)]) continue;
      potential_[at(c)] -= reached - distance[at(c)];
      row_potential_[at(row_of_[at(c)])] += reached - distance[at(c)];
    }
    for (int step = 0; step < all() && column != kNone; ++step) {
      const int previous = before[at(column)];
      row_of_[at(column)] = previous == kNone ? row : row_of_[at(previous)];
      column = previous;
    }
  }

  int rows_ = 0, columns_ = 0;
  std::int32_t gate_ = 0;
  std::array<std::array<std::int32_t, kColumns>, kRows> cost_{};
  std::array<int, kAll> row_of_{};
  std::array<std::int64_t, kAll> potential_{};
  std::array<std::int64_t, kRows> row_potential_{};
};

}  // namespace tetap::slam
