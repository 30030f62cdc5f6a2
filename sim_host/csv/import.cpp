// SPDX-License-Identifier: Apache-2.0
#include "sim_host/csv/import.hpp"

#include "sim_host/csv/importer.hpp"

namespace tetap::csv {

namespace {

sim::Failure refused_quantity(const std::string& option) {
  return {option + ": no such quantity; there are: " + quantity_names(), 0};
}

}  // namespace

sim::Result<Imported> import_tables(std::span<const File> files, const Options& options) {
  if (files.empty()) return sim::Failure{"no table to import", 0};
  for (const Named& named : options.units) {
    const auto fits = [&](const Quantity& quantity) {
      const bool meant = named.quantity == quantity.name || named.quantity == kind_name(quantity.kind);
      return meant && unit_of(named.text, quantity.dimension).has_value();
    };
    const auto all = quantities();
    if (named.quantity == "quaternion" || std::any_of(all.begin(), all.end(), fits)) continue;
    std::string units;
    for (const Quantity& quantity : all)
      if (units.empty() && (named.quantity == quantity.name || named.quantity == kind_name(quantity.kind)))
        units = units_of(quantity.dimension);
    const std::string option = "--unit " + named.quantity + "=" + named.text;
    if (units.empty()) return refused_quantity(option);
    return sim::Failure{option + ": no such unit; there are: " + units, 0};
  }
  for (const Named& named : options.columns)
    if (find_quantity(named.quantity) == nullptr) return refused_quantity("--column " + named.quantity);
  auto tables = read_tables(files, options);
  if (!tables) return tables.failure();
  return Importer(std::move(*tables), files, options).run();
}

std::string quantity_names() {
  std::string names;
  for (const Quantity& quantity : quantities()) names += (names.empty() ? "" : " ") + std::string(quantity.name);
  return names;
}

}  // namespace tetap::csv
