// SPDX-License-Identifier: Apache-2.0
// The columns of a table: what each holds, in which unit, and how the time is written.
#pragma once

#include "sim_host/csv/import.hpp"
#include "sim_host/csv/quantities.hpp"
#include "sim_host/csv/table.hpp"
#include "sim_host/replay/result.hpp"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

namespace tetap::csv {

/// A column and what it holds.
struct Bound {
  std::size_t column = 0;
  Guess guess;
  Unit unit;
  bool stated = false;              ///< the unit stands in the table or was named
  std::optional<std::size_t> side;  ///< column of a place's letter: N, S, E or W
};

/// How the time of a table is written.
struct Clock {
  std::size_t column = 0;
  int power = 6;
  bool calendar = false;
  std::optional<std::size_t> nanoseconds;  ///< column of the part below a second
};

/// The column of a table that the user's text names, "COLUMN" or "FILE:COLUMN".
[[nodiscard]] std::optional<std::size_t> named_column(std::string_view text, const Table& table);
/// One column to a quantity: those that are named, and those that their names show.
[[nodiscard]] sim::Result<std::vector<Bound>> bind_columns(const Table& table, const Options& options);
/// Takes the column of time out of `bound`. Looks at the first rows where no unit is stated.
[[nodiscard]] sim::Result<Clock> take_clock(const Table& table, std::vector<Bound>& bound);
/// A row's time [us]; the failure names the cell that is none.
[[nodiscard]] sim::Result<std::int64_t> time_of(const Table& table, const Clock& clock,
                                                const std::vector<std::string_view>& cells);
/// The column whose values part the rows of several like devices, as ArduPilot's I. A column `i` with other values, a
/// current or the number of the row, is none.
[[nodiscard]] std::optional<std::size_t> instance_column(const Table& table, const Clock& clock);
/// The units of a pressure, a place and a field by the size of their first values, where none is stated.
void guess_sizes(const Table& table, std::vector<Bound>& bound);

}  // namespace tetap::csv
