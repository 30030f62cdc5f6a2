// SPDX-License-Identifier: Apache-2.0
#include "sim_host/csv/columns.hpp"

#include "sim_host/csv/number.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

namespace tetap::csv {

namespace {

bool is_of_file(std::string_view named, const Table& table) {
  if (named == table.name() || named == table.stem()) return true;
  return table.name().ends_with(named) && table.name()[table.name().size() - named.size() - 1] == '/';
}

/// The unit that the user names for a quantity.
sim::Result<std::optional<Unit>> named_unit(const Quantity& quantity, const Options& options) {
  std::optional<Unit> unit;
  for (const Named& named : options.units) {
    const bool whole = named.quantity == quantity.name;
    if (!whole && named.quantity != kind_name(quantity.kind)) continue;
    const auto found = unit_of(named.text, quantity.dimension);
    if (found) unit = found;
    if (!found && whole)
      return sim::Failure{
          "--unit " + named.quantity + "=" + named.text + ": no such unit; there are: " + units_of(quantity.dimension),
          0};
  }
  return unit;
}

std::string small_letters(std::string_view text) {
  std::string small(text);
  for (char& c : small) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return small;
}

template <class Is>
std::optional<std::size_t> find_column(const Table& table, Is is) {
  for (std::size_t i = 0; i < table.columns().size(); ++i)
    if (is(small_letters(table.columns()[i]))) return i;
  return std::nullopt;
}

/// "...nanosec" beside "...sec": ROS writes a stamp in two whole numbers.
std::optional<std::size_t> nanoseconds_beside(const Table& table, std::size_t seconds) {
  std::string begin = small_letters(table.columns()[seconds]);
  if (begin.ends_with("secs")) begin.pop_back();
  if (!begin.ends_with("sec")) return std::nullopt;
  begin.resize(begin.size() - 3);
  return find_column(table, [&](const std::string& name) {
    if (!name.starts_with(begin)) return false;
    const std::string_view rest = std::string_view(name).substr(begin.size());
    return rest == "nanosec" || rest == "nanosecs" || rest == "nsec" || rest == "nsecs";
  });
}

/// The column with the letter of a latitude or a longitude.
std::optional<std::size_t> side_of(const Table& table, bool latitude) {
  const std::string letters = latitude ? "ns" : "ew", axis = latitude ? "lat" : "lon";
  return find_column(table, [&](std::string name) {
    std::erase_if(name, [](char c) { return c < 'a' || c > 'z'; });
    const bool hemisphere = name.starts_with(axis) && (name.ends_with("hemisphere") || name.ends_with("direction") ||
                                                       name.ends_with("dir") || name.ends_with("ref"));
    return name == letters || name == letters + "indicator" || name == axis + letters || hemisphere;
  });
}

}  // namespace

std::optional<std::size_t> named_column(std::string_view text, const Table& table) {
  for (std::size_t i = 0; i < table.columns().size(); ++i) {
    const std::string_view column = table.columns()[i];
    if (column == text) return i;
    if (text.ends_with(column) && text.size() > column.size() + 1) {
      const std::string_view file = text.substr(0, text.size() - column.size());
      if (file.back() == ':' && is_of_file(file.substr(0, file.size() - 1), table)) return i;
    }
  }
  return std::nullopt;
}

sim::Result<std::vector<Bound>> bind_columns(const Table& table, const Options& options) {
  const auto& columns = table.columns();
  bool phone = false, placed = false;
  for (const std::string& column : columns) {
    phone = phone || column == "seconds_elapsed";
    const auto guess = guess_column(column, table.stem(), false, true);
    placed = placed || (guess && guess->quantity->name == "gnss.lat");
  }
  std::vector<Bound> bound;
  for (std::size_t i = 0; i < columns.size(); ++i)
    if (auto guess = guess_column(columns[i], table.stem(), phone, placed)) bound.push_back({i, std::move(*guess), {}});
  for (const Named& named : options.columns) {
    const Quantity* quantity = find_quantity(named.quantity);
    if (quantity == nullptr) continue;  // import_tables() refuses it
    const auto column = named_column(named.text, table);
    if (!column) continue;
    std::string unit;
    for (const Bound& b : bound)
      if (b.column == *column) unit = b.guess.unit;
    std::erase_if(bound, [&](const Bound& b) { return b.column == *column || b.guess.quantity == quantity; });
    if (const auto brackets = columns[*column].find_last_of("(["); unit.empty() && brackets != std::string::npos)
      unit = columns[*column].substr(brackets + 1, columns[*column].size() - brackets - 2);
    bound.push_back({*column, {quantity, unit, -10}, {}});
  }
  // One column to a quantity: the best, and of equal ones the first.
  std::stable_sort(bound.begin(), bound.end(), [](const Bound& a, const Bound& b) {
    return std::pair(a.guess.quantity, a.guess.rank) < std::pair(b.guess.quantity, b.guess.rank);
  });
  const auto same = [](const Bound& a, const Bound& b) { return a.guess.quantity == b.guess.quantity; };
  bound.erase(std::unique(bound.begin(), bound.end(), same), bound.end());
  for (Bound& b : bound) {
    const Quantity& quantity = *b.guess.quantity;
    const auto named = named_unit(quantity, options);
    if (!named) return named.failure();
    auto unit = *named;
    // phyphox writes degrees for the metres of a vertical accuracy.
    const bool mislabelled = quantity.dimension == Dimension::kLength && unit_of(b.guess.unit, Dimension::kAngle);
    if (!unit && !b.guess.unit.empty() && !mislabelled) unit = unit_of(b.guess.unit, quantity.dimension);
    b.stated = unit.has_value();
    if (!unit && !b.guess.unit.empty() && !mislabelled)
      return sim::Failure{
          table.name() + ":" + std::to_string(table.line()) + ": column " + std::to_string(b.column + 1) + " '" +
              excerpt(columns[b.column]) + "': no unit '" + excerpt(b.guess.unit) + "' of " +
              std::string(quantity.name) + "; name it, as in --unit " + std::string(quantity.name) + "=" +
              std::string(usual_unit(quantity.dimension).name) + " (" + units_of(quantity.dimension) + ")",
          table.line()};
    b.unit = unit.value_or(usual_unit(quantity.dimension));
    if (!unit && quantity.dimension == Dimension::kAngle && quantity.kind == Kind::kVelocity)
      b.unit = *unit_of("deg", Dimension::kAngle);  // no receiver states a course in radians
    if (quantity.dimension == Dimension::kPlace) b.side = side_of(table, quantity.name == "gnss.lat");
  }
  return bound;
}

sim::Result<Clock> take_clock(const Table& table, std::vector<Bound>& bound) {
  const auto found =
      std::find_if(bound.begin(), bound.end(), [](const Bound& b) { return b.guess.quantity->kind == Kind::kTime; });
  if (found == bound.end())
    return sim::Failure{
        table.name() + ":" + std::to_string(table.line()) + ": no column of time; name it, as in --column time=COLUMN",
        table.line()};
  Clock clock{.column = found->column, .power = found->unit.power};
  clock.nanoseconds = nanoseconds_beside(table, found->column);
  const bool stated = found->stated;
  bound.erase(found);
  Table sample = table;
  std::vector<std::string_view> cells;
  std::optional<double> first;
  bool fraction = false;
  for (int row = 0; row < 64 && sample.next(cells); ++row) {
    const std::string_view cell = cells[clock.column];
    if (is_missing(cell)) continue;
    if (parse_calendar(cell)) return clock.calendar = true, clock;
    const auto value = parse_real(cell, sample.point());
    if (!value) return sample.refuse(clock.column, cell, "is no time");
    if (!first) first = value;
    fraction = fraction || cell.find(sample.point()) != std::string_view::npos;
  }
  if (!first || stated) return clock;
  const double size = std::abs(*first);
  if (size >= 1e17) return clock.power = -3, clock;  // since 1970, in ns, us, ms or s
  if (size >= 1e14) return clock.power = 0, clock;
  if (size >= 1e11) return clock.power = 3, clock;
  if (size >= 1e8 || fraction) return clock.power = 6, clock;
  return sim::Failure{table.name() + ":" + std::to_string(table.line()) + ": column " +
                          std::to_string(clock.column + 1) + " '" + excerpt(table.columns()[clock.column]) +
                          "': whole numbers whose unit is not stated; name it, as in --unit time=ms (s ms us ns)",
                      table.line()};
}

namespace {

/// The median of a column's first values, of a field's axes the largest in each row. 0: the column has none.
double usual_size(const Table& table, const std::vector<Bound>& bound, const Bound& of) {
  Table sample = table;
  std::vector<std::string_view> cells;
  std::vector<double> sizes;
  const Dimension dimension = of.guess.quantity->dimension;
  while (sizes.size() < 64 && sample.next(cells)) {
    double size = 0;
    for (const Bound& one : bound) {
      const bool axis = dimension == Dimension::kFlux && one.guess.quantity->dimension == dimension;
      if (axis || one.column == of.column)
        size = std::max(size, std::abs(parse_real(cells[one.column], sample.point()).value_or(0)));
    }
    if (size > 0) sizes.push_back(size);
  }
  if (sizes.empty()) return 0;
  const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
  std::nth_element(sizes.begin(), middle, sizes.end());
  return *middle;
}

}  // namespace

namespace {

constexpr std::size_t kMostDevices = 16, kFewestRows = 3;

/// The rows of a table that have a time, and which value of a column each has.
struct PartedRows {
  std::vector<std::int64_t> time_us;
  std::vector<std::size_t> device;
  std::vector<std::string> values;
};

/// Nothing where the values are no numbers of devices: no whole numbers, or too many.
std::optional<PartedRows> parted_rows(const Table& table, const Clock& clock, std::size_t column) {
  PartedRows rows;
  Table sample = table;
  std::vector<std::string_view> cells;
  while (sample.next(cells)) {
    if (is_missing(cells[clock.column])) continue;
    const auto number = parse_whole(cells[column], sample.point(), 6);
    const auto time = time_of(sample, clock, cells);
    if (!time || !number || *number < 0 || *number % 1'000'000 != 0) return std::nullopt;
    const auto known = std::find(rows.values.begin(), rows.values.end(), cells[column]);
    if (known == rows.values.end() && rows.values.size() == kMostDevices) return std::nullopt;
    rows.device.push_back(static_cast<std::size_t>(known - rows.values.begin()));
    rows.time_us.push_back(*time);
    if (known == rows.values.end()) rows.values.emplace_back(cells[column]);
  }
  return rows;
}

/// Whether nine of ten steps are within half of the usual one.
bool is_regular(std::vector<std::int64_t> steps) {
  std::sort(steps.begin(), steps.end());
  const std::int64_t usual = steps[steps.size() / 2];
  const auto near = [&](std::int64_t step) { return 2 * step >= usual && 2 * step <= 3 * usual; };
  return 10 * std::count_if(steps.begin(), steps.end(), near) >= 9 * static_cast<std::ptrdiff_t>(steps.size());
}

/// Whether each value repeats the stamps of the others, or has regular ones of its own between theirs.
bool are_devices(const PartedRows& rows) {
  struct Device {
    std::size_t rows = 0, beside_another = 0;
    std::int64_t last_us = 0;
    std::vector<std::int64_t> steps;
  };
  std::vector<Device> devices(rows.values.size());
  const auto is_other = [&](std::size_t i, std::size_t k) { return rows.device[k] != rows.device[i]; };
  const std::size_t count = rows.device.size();
  std::size_t repeated = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const bool before = i > 0 && is_other(i, i - 1), behind = i + 1 < count && is_other(i, i + 1);
    repeated +=
        (before && rows.time_us[i - 1] == rows.time_us[i]) || (behind && rows.time_us[i + 1] == rows.time_us[i]);
    Device& device = devices[rows.device[i]];
    if (device.rows++ > 0) device.steps.push_back(rows.time_us[i] - device.last_us);
    device.last_us = rows.time_us[i];
    device.beside_another += before || behind;
  }
  const auto fewer = [](const Device& a, const Device& b) { return a.rows < b.rows; };
  const auto most = std::max_element(devices.begin(), devices.end(), fewer);
  if (std::any_of(devices.begin(), devices.end(), [](const Device& one) { return one.rows < kFewestRows; }))
    return false;
  if (2 * repeated >= count) return true;
  return std::all_of(devices.begin(), devices.end(), [&](const Device& one) {
    return is_regular(one.steps) && (&one == &*most || 10 * one.beside_another >= 9 * one.rows);
  });
}

}  // namespace

sim::Result<std::int64_t> time_of(const Table& table, const Clock& clock, const std::vector<std::string_view>& cells) {
  const std::string_view text = cells[clock.column];
  const auto time = clock.calendar ? parse_calendar(text) : parse_whole(text, table.point(), clock.power);
  if (!time) return table.refuse(clock.column, text, "is no time");
  if (!clock.nanoseconds) return *time;
  const std::string_view rest = cells[*clock.nanoseconds];
  const auto part = parse_whole(rest, table.point(), -3);
  if (!part || *part < 0 || *part > 1'000'000)
    return table.refuse(*clock.nanoseconds, rest, "is no part of a second in nanoseconds");
  return *time + *part;
}

std::optional<std::size_t> instance_column(const Table& table, const Clock& clock) {
  if (const auto stated = find_column(table, [](const std::string& name) { return name == "instance"; })) return stated;
  const auto column = find_column(table, [](const std::string& name) { return name == "i"; });
  if (!column) return std::nullopt;
  const auto rows = parted_rows(table, clock, *column);
  return rows && are_devices(*rows) ? column : std::nullopt;
}

void guess_sizes(const Table& table, std::vector<Bound>& bound) {
  for (Bound& b : bound) {
    const Dimension dimension = b.guess.quantity->dimension;
    const double size = b.stated ? 0 : usual_size(table, bound, b);
    // No pressure of air is below 200 hPa where robots are, nor above 1 200.
    if (dimension == Dimension::kPressure && size > 0)
      b.unit = *unit_of(size < 200 ? "kPa" : size < 2'000 ? "hPa" : "Pa", dimension);
    // The earth has 360 degrees, and whole numbers of 1e-7 degrees exceed them all but at 0, 0.
    if (dimension == Dimension::kPlace && size > 1e5) b.unit = *unit_of("e7", dimension);
    // The earth's field is 22 to 67 uT.
    if (dimension == Dimension::kFlux && size > 0 && (size < 1 || size > 1e4))
      b.unit = *unit_of(size < 1e-3 ? "T" : size < 1 ? "gauss" : "nT", dimension);
  }
  const auto by_size = [](const Bound& b) { return !b.stated && b.unit.name == "e7"; };
  if (std::none_of(bound.begin(), bound.end(), by_size)) return;
  for (Bound& b : bound)  // receivers that write 1e-7 degrees write heights in millimetres
    if (b.guess.quantity->name == "gnss.height" && !b.stated) b.unit = *unit_of("mm", Dimension::kLength);
}

}  // namespace tetap::csv
