// SPDX-License-Identifier: Apache-2.0
#include "sim_host/page/module/tables.hpp"

#include "sim_host/csv/columns.hpp"
#include "sim_host/csv/table.hpp"
#include "sim_host/page/module/browser.hpp"
#include "sim_host/page/module/json.hpp"

#include <algorithm>
#include <iterator>
#include <string_view>
#include <utility>

namespace tetap::page {

namespace {

constexpr std::size_t kBlock = 1 << 16;

void put_bound(Json& json, const csv::Bound& bound) {
  json.begin('{')
      .member("quantity", bound.guess.quantity->name)
      .member("column", bound.column)
      .member("unit", bound.stated || bound.guess.unit.empty() ? bound.unit.name : std::string_view(bound.guess.unit))
      .member("stated", bool{bound.stated})
      .end('}');
}

/// Columns by their names alone, where a unit is none: the page asks for it.
std::vector<csv::Bound> shown(const csv::Table& table) {
  std::vector<csv::Bound> all;
  for (std::size_t i = 0; i < table.columns().size(); ++i)
    if (auto guess = csv::guess_column(table.columns()[i], table.stem(), false, false))
      all.push_back({i, std::move(*guess), {}});
  return all;
}

void put_file(Json& json, const csv::File& file, const csv::Options& options) {
  json.begin('{').member("name", file.name);
  const auto table = csv::Table::open(file.name, file.text);
  json.key("columns").begin('[');
  if (table)
    for (const std::string& column : table->columns()) json.value(csv::excerpt(column));
  json.end(']');
  std::string wrong = table ? "" : table.failure().text;
  json.key("bound").begin('[');
  if (table) {
    auto bound = csv::bind_columns(*table, options);
    if (!bound) wrong = bound.failure().text;
    if (bound) csv::guess_sizes(*table, *bound);
    for (const csv::Bound& one : bound ? *bound : shown(*table)) put_bound(json, one);
  }
  json.end(']').member("wrong", wrong).end('}');
}

}  // namespace

sim::Result<> SensorTables::add_file() {
  if (!two()) return sim::Failure{"a table needs a name and a text"};
  files_.push_back({*std::prev(texts_.end(), 2), texts_.back()});
  return {};
}

csv::Named SensorTables::named() {
  csv::Named named{*std::prev(texts_.end(), 2), texts_.back()};
  texts_.pop_back();
  texts_.pop_back();
  return named;
}

sim::Result<> SensorTables::add_column() {
  if (!two()) return sim::Failure{"a column needs a quantity and a name"};
  options_.columns.push_back(named());
  return {};
}

sim::Result<> SensorTables::add_unit() {
  if (!two()) return sim::Failure{"a unit needs a quantity and a name"};
  options_.units.push_back(named());
  return {};
}

std::string SensorTables::columns() const {
  Json json;
  json.begin('{').key("files").begin('[');
  for (const csv::File& file : files_) put_file(json, file, options_);
  json.end(']').key("quantities").begin('[');
  for (const csv::Quantity& one : csv::quantities())
    json.begin('{').member("name", one.name).member("units", csv::units_of(one.dimension)).end('}');
  return json.end(']').end('}').text();
}

sim::Result<> SensorTables::import(std::uint32_t base) {
  options_.base = base;
  const auto imported = csv::import_tables(files_, options_);
  if (!imported) return imported.failure();
  const std::string_view log = imported->log;
  for (std::size_t at = 0; at < log.size(); at += kBlock) write(Channel::kFrames, log.substr(at, kBlock));
  Json json;
  json.begin('{')
      .member("frames", imported->frames)
      .member("rows", imported->rows)
      .member("duration_s", imported->duration_s)
      .key("sources")
      .begin('[');
  for (const csv::Source& one : imported->sources)
    json.begin('{')
        .member("sensor", one.sensor)
        .member("columns", one.columns)
        .member("samples", one.samples)
        .member("rate_hz", one.rate_hz)
        .end('}');
  json.end(']').key("left_out").begin('[');
  for (const csv::LeftOut& one : imported->left_out)
    json.begin('{').member("what", one.what).member("count", one.count).end('}');
  json.end(']').key("notes").begin('[');
  for (const std::string& note : imported->notes) json.value(note);
  write(Channel::kImported, json.end(']').end('}').text());
  return {};
}

}  // namespace tetap::page
