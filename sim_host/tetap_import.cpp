// SPDX-License-Identifier: Apache-2.0
// tetap-import: tables of sensors (CSV) as a candump log.
#include "sim_host/csv/import.hpp"
#include "sim_host/csv/units.hpp"
#include "sim_host/play/arguments.hpp"
#include "sim_host/play/out_file.hpp"

#include <algorithm>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

using namespace tetap;

constexpr const char* kHelp = R"--(usage: tetap-import FILE.csv... [--out LOG] [OPTION]...

Writes the log of a recording that is in tables: a row a sample, names in the first line. Several files are one
recording; a folder stands for the .csv files in it. The exports of phyphox and of Sensor Logger are read as they are.
Columns are known by their names, units by the names as well: gyro_x_dps, Acceleration x (m/s^2), speed [knots].

  --out LOG            (default out/import.log)
  --column Q=COLUMN    the column that holds the quantity Q, where its name does not tell; FILE:COLUMN for one file's
  --unit Q=UNIT        the unit of Q, or of all of a sensor (accel=g); a minus before it turns the sign
  --unit quaternion=F  of heading.qw to qz: enu (body to east north up; default), ned, enu-inverse, ned-inverse
  --base ID            first id of the node's block (default 0x300)
  --interface NAME     in the log's lines (default vcan0)

A heading is taken only where it is named: that of a telephone has a zero of its own.

Quantities: %s
Units:
%s
Exit status: 0; 2 bad usage or a table that cannot be read, with file, line and column.
)--";

std::string content(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw std::runtime_error(path + ": cannot be opened");
  std::string text{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  if (file.bad()) throw std::runtime_error(path + ": cannot be read");
  return text;
}

/// The tables of a folder in the order of their names.
std::vector<std::string> tables_of(const std::string& path) {
  if (!std::filesystem::is_directory(path)) return {path};
  std::vector<std::string> paths;
  for (const auto& entry : std::filesystem::directory_iterator(path))
    if (entry.path().extension() == ".csv") paths.push_back(entry.path().string());
  if (paths.empty()) throw std::runtime_error(path + ": no .csv file in this folder");
  std::sort(paths.begin(), paths.end());
  return paths;
}

std::vector<csv::Named> named(sim::Arguments& arguments, const char* option) {
  std::vector<csv::Named> all;
  for (const std::string& text : arguments.texts(option)) {
    const std::size_t equals = text.find('=');
    if (equals == std::string::npos || equals == 0 || equals + 1 == text.size())
      throw sim::UsageError(std::string(option) + " needs QUANTITY=TEXT, not '" + text + "'");
    all.push_back({text.substr(0, equals), text.substr(equals + 1)});
  }
  return all;
}

int import(sim::Arguments& arguments) {
  const std::string out = arguments.text("--out").value_or("out/import.log");
  csv::Options options{.columns = named(arguments, "--column"), .units = named(arguments, "--unit")};
  options.base = arguments.base();
  options.interface = arguments.text("--interface").value_or("vcan0");
  std::vector<std::string> paths;
  while (const auto path = arguments.positional())
    for (const std::string& one : tables_of(*path)) paths.push_back(one);
  arguments.finish();
  if (paths.empty()) throw sim::UsageError("which table? (--help)");
  std::vector<std::string> texts;
  for (const std::string& path : paths) texts.push_back(content(path));
  std::vector<csv::File> files;
  for (std::size_t i = 0; i < paths.size(); ++i) files.push_back({paths[i], texts[i]});
  const auto imported = csv::import_tables(files, options);
  if (!imported) throw std::runtime_error(imported.failure().text);
  if (const auto folder = std::filesystem::path(out).parent_path(); !folder.empty()) sim::make_folder(folder.string());
  sim::OutFile file(out);
  file.write(imported->log);
  file.close();
  std::printf("%s: %llu frames, %.1f s, of %llu rows\n", out.c_str(), static_cast<unsigned long long>(imported->frames),
              imported->duration_s, static_cast<unsigned long long>(imported->rows));
  for (const csv::Source& source : imported->sources)
    std::printf("  %-9s %llu samples, %.1f Hz: %s\n", source.sensor.c_str(),
                static_cast<unsigned long long>(source.samples), source.rate_hz, source.columns.c_str());
  for (const csv::LeftOut& one : imported->left_out)
    std::printf("  left out: %llu %s\n", static_cast<unsigned long long>(one.count), one.what.c_str());
  for (const std::string& note : imported->notes) std::printf("  %s\n", note.c_str());
  return 0;
}

}  // namespace

int main(int count, char** values) {
  try {
    sim::Arguments arguments(count, values);
    if (arguments.flag("--help") || arguments.flag("-h"))
      return std::printf(kHelp, csv::quantity_names().c_str(), csv::unit_table().c_str()), 0;
    return import(arguments);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "tetap-import: %s\n", error.what());
    return 2;
  }
}
