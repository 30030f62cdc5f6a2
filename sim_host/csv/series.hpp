// SPDX-License-Identifier: Apache-2.0
// Tables of one recording as rows of sensors, in the units of the bus.
#pragma once

#include "sim_host/csv/import.hpp"
#include "sim_host/csv/quantities.hpp"
#include "sim_host/replay/result.hpp"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace tetap::csv {

/// The rows of one sensor in one table, in order of time. NaN: no value.
struct Series {
  Kind kind = Kind::kTime;
  std::size_t file = 0;
  int rank = 0;         ///< the lowest of a kind is taken
  std::string columns;  ///< "x y z [rad/s]", for people
  std::vector<std::int64_t> time_us;
  std::vector<double> values;  ///< slots_of(kind) to a row

  [[nodiscard]] std::size_t size() const { return time_us.size(); }
  [[nodiscard]] std::span<const double> row(std::size_t i) const {
    const std::size_t stride = slots_of(kind);
    return std::span(values).subspan(i * stride, stride);
  }
};

/// Every sensor of every table, and what was left out on the way.
struct Tables {
  std::uint64_t rows = 0;
  std::vector<Series> series;
  std::vector<LeftOut> left_out;
  std::vector<std::string> notes;
};

[[nodiscard]] sim::Result<Tables> read_tables(std::span<const File> files, const Options& options);

/// Adds to what is counted already under these words.
void count_left_out(std::vector<LeftOut>& all, const std::string& what, std::uint64_t count = 1);

}  // namespace tetap::csv
