// SPDX-License-Identifier: Apache-2.0
#include "sim_host/csv/series.hpp"

#include "sim_host/csv/columns.hpp"
#include "sim_host/csv/number.hpp"
#include "sim_host/csv/table.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <utility>

namespace tetap::csv {

namespace {

constexpr std::int64_t kDisorder_us = 100'000;    ///< rows out of order by up to this much are sorted
constexpr std::int64_t kJump_us = 3'600'000'000;  ///< a longer gap is a broken time
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

class Reader {
 public:
  Reader(std::span<const File> files, const Options& options) : files_(files), options_(options) {}

  sim::Result<Tables> read() {
    std::vector<bool> found(options_.columns.size());
    std::string columns;
    for (std::size_t i = 0; i < files_.size(); ++i) {
      auto table = Table::open(files_[i].name, files_[i].text);
      if (!table) {
        if (files_.size() == 1) return table.failure();
        tables_.notes.push_back(table.failure().text + ", left out");
        continue;
      }
      for (const std::string& column : table->columns()) columns += (columns.empty() ? "" : ", ") + excerpt(column);
      for (std::size_t n = 0; n < found.size(); ++n)
        found[n] = found[n] || named_column(options_.columns[n].text, *table).has_value();
      if (const auto done = add(i, *table); !done) return done.failure();
    }
    for (std::size_t n = 0; n < found.size(); ++n)
      if (!found[n])
        return sim::Failure{"no column '" + options_.columns[n].text + "' for " + options_.columns[n].quantity +
                                "; there are: " + columns,
                            0};
    if (tables_.series.empty())
      return sim::Failure{files_.front().name + ":1: no column of a known name: " + columns +
                              "; name them, as in --column accel.x=COLUMN (--help lists the quantities)",
                          1};
    return std::move(tables_);
  }

 private:
  sim::Result<> add(std::size_t file, Table& table);
  sim::Result<> rows(Table& table, const Clock& clock, const std::vector<Bound>& bound, std::span<Series> series);

  std::span<const File> files_;
  const Options& options_;
  Tables tables_;
};

sim::Result<> Reader::add(std::size_t file, Table& table) {
  auto bound = bind_columns(table, options_);
  if (!bound) return bound.failure();
  const bool any = std::any_of(bound->begin(), bound->end(), [](const Bound& b) {
    return b.guess.quantity->kind != Kind::kTime && b.guess.quantity->name != "gyro.temperature";
  });
  if (!any) {
    if (files_.size() > 1) tables_.notes.push_back(table.name() + ": no column of a known name, left out");
    return {};
  }
  const auto time = take_clock(table, *bound);
  if (!time) return time.failure();
  guess_sizes(table, *bound);
  std::array<std::optional<std::size_t>, kKinds> place{};
  std::vector<Series> series;
  std::vector<bool> used(table.columns().size());
  used[time->column] = true;
  if (time->nanoseconds) used[*time->nanoseconds] = true;
  for (const Bound& b : *bound)
    if (b.side) used[*b.side] = true;
  for (const Bound& b : *bound) {
    used[b.column] = true;
    auto& at = place[static_cast<std::size_t>(b.guess.quantity->kind)];
    if (!at) {
      at = series.size();
      series.push_back({.kind = b.guess.quantity->kind,
                        .file = file,
                        .rank = b.guess.rank,
                        .columns = {},
                        .time_us = {},
                        .values = {}});
    }
    Series& one = series[*at];
    one.rank = std::min(one.rank, b.guess.rank);
    one.columns += (one.columns.empty() ? "" : ", ") + excerpt(table.columns()[b.column]);
    const bool named = b.guess.quantity->dimension == Dimension::kNumber || table.columns()[b.column].ends_with(')') ||
                       table.columns()[b.column].ends_with(']');
    if (!named)
      one.columns +=
          " [" + std::string(b.unit.factor < 0 ? "-" : "") + std::string(b.unit.name) + (b.stated ? "]" : " assumed]");
  }
  std::string unused;
  for (std::size_t i = 0; i < used.size(); ++i)
    if (!used[i]) unused += (unused.empty() ? "" : ", ") + excerpt(table.columns()[i]);
  if (!unused.empty()) tables_.notes.push_back(table.name() + ": not used: " + unused);
  if (const auto done = rows(table, *time, *bound, series); !done) return done;
  for (Series& one : series)
    if (one.size() != 0) tables_.series.push_back(std::move(one));
  return {};
}

/// ddmm.mmmm as NMEA 0183 writes a place.
double from_minutes(double value) {
  const double degrees = std::trunc(value / 100);
  return degrees + (value - 100 * degrees) / 60;
}

/// Cuts the letter behind a place. S and W are negative, there or in a column beside.
bool is_south_or_west(std::string_view& place, std::string_view side, bool of_place) {
  if (of_place && place.size() > 1 && std::string_view("NSEWnsew").find(place.back()) != std::string_view::npos) {
    side = place.substr(place.size() - 1);
    place.remove_suffix(1);
    while (place.size() > 1 && place.back() == ' ') place.remove_suffix(1);
  }
  return side == "S" || side == "s" || side == "W" || side == "w";
}

sim::Result<> Reader::rows(Table& table, const Clock& clock, const std::vector<Bound>& bound,
                           std::span<Series> series) {
  struct Cell {
    std::size_t column, series, slot;
    Unit unit;
    std::optional<std::size_t> side;
    bool place;
  };
  std::vector<Cell> plan;
  for (const Bound& b : bound)
    for (std::size_t i = 0; i < series.size(); ++i)
      if (series[i].kind == b.guess.quantity->kind)
        plan.push_back(
            {b.column, i, b.guess.quantity->slot, b.unit, b.side, b.guess.quantity->dimension == Dimension::kPlace});
  std::vector<std::array<double, kMostSlots>> row(series.size());
  std::vector<bool> any(series.size());
  std::vector<std::string_view> cells;
  std::optional<std::int64_t> latest;
  std::uint64_t count = 0, disordered = 0;
  const auto instance = instance_column(table, clock);
  std::string first;
  while (table.next(cells)) {
    if (instance && first.empty()) first = cells[*instance];
    if (instance && cells[*instance] != first) {
      count_left_out(tables_.left_out, "rows of " + table.name() + " of another device than " +
                                           table.columns()[*instance] + " " + excerpt(first));
      continue;
    }
    const std::string_view text = cells[clock.column];
    if (is_missing(text)) {
      count_left_out(tables_.left_out, "rows of " + table.name() + " without a time");
      continue;
    }
    const auto time = time_of(table, clock, cells);
    if (!time) return time.failure();
    if (latest && *time < *latest - kDisorder_us)
      return table.refuse(clock.column, text, "goes back by more than 0.1 s");
    if (latest && *time > *latest + kJump_us) return table.refuse(clock.column, text, "is more than an hour later");
    disordered += latest && *time < *latest ? 1 : 0;
    latest = std::max(latest.value_or(*time), *time);
    ++count;
    for (std::size_t i = 0; i < series.size(); ++i) row[i].fill(kNan), any[i] = false;
    for (const Cell& cell : plan) {
      std::string_view number = cells[cell.column];
      if (is_missing(number)) continue;
      const bool negative = is_south_or_west(number, cell.side ? cells[*cell.side] : std::string_view(), cell.place);
      auto value = parse_real(number, table.point());
      if (!value) return table.refuse(cell.column, number, "is no number");
      if (negative) *value = -std::abs(*value);
      const double degrees = cell.unit.minutes ? from_minutes(*value) : *value;
      row[cell.series][cell.slot] = cell.unit.factor * degrees + cell.unit.offset;
      any[cell.series] = true;
    }
    for (std::size_t i = 0; i < series.size(); ++i) {
      if (!any[i]) continue;
      series[i].time_us.push_back(*time);
      series[i].values.insert(series[i].values.end(), row[i].begin(),
                              row[i].begin() + static_cast<std::ptrdiff_t>(slots_of(series[i].kind)));
    }
  }
  if (table.failure() != nullptr) return *table.failure();
  if (table.cut_off()) tables_.notes.push_back(table.name() + ": the last line is cut off and left out");
  if (count == 0) return sim::Failure{table.name() + ": no row in it", 0};
  tables_.rows += count;
  if (disordered == 0) return {};
  tables_.notes.push_back(table.name() + ": " + std::to_string(disordered) + " rows were out of order and are sorted");
  for (Series& one : series) {
    std::vector<std::size_t> order(one.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return one.time_us[a] < one.time_us[b]; });
    Series sorted = one;
    const std::size_t stride = slots_of(one.kind);
    for (std::size_t i = 0; i < order.size(); ++i) {
      sorted.time_us[i] = one.time_us[order[i]];
      std::copy_n(one.values.begin() + static_cast<std::ptrdiff_t>(order[i] * stride), stride,
                  sorted.values.begin() + static_cast<std::ptrdiff_t>(i * stride));
    }
    one = std::move(sorted);
  }
  return {};
}

}  // namespace

void count_left_out(std::vector<LeftOut>& all, const std::string& what, std::uint64_t count) {
  if (count == 0) return;
  const auto found = std::find_if(all.begin(), all.end(), [&](const LeftOut& one) { return one.what == what; });
  if (found != all.end()) {
    found->count += count;
  } else {
    all.push_back({what, count});
  }
}

sim::Result<Tables> read_tables(std::span<const File> files, const Options& options) {
  return Reader(files, options).read();
}

}  // namespace tetap::csv
