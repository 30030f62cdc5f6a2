// SPDX-License-Identifier: Apache-2.0
// Tables of sensors (CSV) as a candump log. Files in memory and no exception, so that a page can use it.
#pragma once

#include "sim_host/replay/result.hpp"

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace tetap::csv {

struct File {
  std::string name;       ///< "Gyroscope.csv": shown in errors, and its words name what x, y and z are
  std::string_view text;  ///< outlives the import
};

/// "accel.x" and a column of that name; "accel" and a unit.
struct Named {
  std::string quantity;
  std::string text;
};

struct Options {
  std::vector<Named> columns;  ///< "accel.x" = "COLUMN" or "FILE:COLUMN"; the others are guessed
  std::vector<Named> units;    ///< "accel" or "accel.x" = "g", "-g"; "time" = "ms"; "quaternion" = "ned-inverse"
  std::uint32_t base = 0x300;  ///< id base of the node
  std::string interface = "vcan0";
};

struct Source {
  std::string sensor;   ///< "imu"
  std::string columns;  ///< "Gyroscope.csv: x y z [rad/s]"
  std::uint64_t samples = 0;
  double rate_hz = 0;
};

struct LeftOut {
  std::string what;
  std::uint64_t count = 0;
};

struct Imported {
  std::string log;
  std::uint64_t frames = 0;
  std::uint64_t rows = 0;     ///< rows of all tables that were read
  std::int64_t begin_us = 0;  ///< time of the tables at 1.000000 s of the log
  double duration_s = 0;
  std::vector<Source> sources;
  std::vector<LeftOut> left_out;
  std::vector<std::string> notes;
};

/// The files are one recording: their times count from one begin. The log's first sample is at 1.000000 s.
///
/// A value beyond its signal's range leaves its sample out; nothing is limited. An IMU sample is rate and specific
/// force at the gyroscope's time, times the time since the row before; a force from another table is interpolated.
/// After a pause of more than 65.5 ms a sample spans the usual interval.
///
/// Failures: "FILE:LINE: column 3 'x': 'abc' is no number", or what is named wrongly.
[[nodiscard]] sim::Result<Imported> import_tables(std::span<const File> files, const Options& options);

/// The names that a column can have, for help.
[[nodiscard]] std::string quantity_names();

}  // namespace tetap::csv
