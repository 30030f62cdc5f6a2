// SPDX-License-Identifier: Apache-2.0
// Parameters of an IMU's noise from the words of its data sheet. An instability B is the least Allan deviation over
// 0.664 of a bias; the bias is taken as a first-order Markov process of 300 s (IEEE Std 952-1997, annex C).
#pragma once

#include "sim_host/play/arguments.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace tetap::sim {

struct DatasheetUnit {
  std::string_view name;
  double factor;  ///< to the unit of the parameter
};
inline constexpr double kDegree = std::numbers::pi / 180, kG_mps2 = 9.80665;
inline constexpr std::array kGyroDensity{DatasheetUnit{"rad/s/rtHz", 1},
                                         DatasheetUnit{"dps/rtHz", kDegree},
                                         DatasheetUnit{"deg/s/rtHz", kDegree},
                                         DatasheetUnit{"mdps/rtHz", 1e-3 * kDegree},
                                         DatasheetUnit{"deg/h/rtHz", kDegree / 3600},
                                         DatasheetUnit{"deg/rth", kDegree / 60}};
inline constexpr std::array kAccelDensity{DatasheetUnit{"m/s2/rtHz", 1}, DatasheetUnit{"g/rtHz", kG_mps2},
                                          DatasheetUnit{"mg/rtHz", 1e-3 * kG_mps2},
                                          DatasheetUnit{"ug/rtHz", 1e-6 * kG_mps2}, DatasheetUnit{"m/s/rth", 1.0 / 60}};
inline constexpr std::array kGyroBias{DatasheetUnit{"rad/s", 1}, DatasheetUnit{"dps", kDegree},
                                      DatasheetUnit{"deg/s", kDegree}, DatasheetUnit{"mdps", 1e-3 * kDegree},
                                      DatasheetUnit{"deg/h", kDegree / 3600}};
inline constexpr std::array kAccelBias{DatasheetUnit{"m/s2", 1}, DatasheetUnit{"g", kG_mps2},
                                       DatasheetUnit{"mg", 1e-3 * kG_mps2}, DatasheetUnit{"ug", 1e-6 * kG_mps2}};
inline constexpr std::array kRatio{DatasheetUnit{"%", 1e-2}, DatasheetUnit{"1", 1}};

struct DatasheetRow {
  std::string_view quantity, path;
  std::span<const DatasheetUnit> units;
  bool walk;  ///< an instability: the parameter is the walk of the bias
};
inline constexpr std::array kDatasheetRows{
    DatasheetRow{"gyro-noise", "inertial.gyro_radps_rthz", kGyroDensity, false},
    DatasheetRow{"accel-noise", "inertial.accel_mps2_rthz", kAccelDensity, false},
    DatasheetRow{"gyro-instability", "inertial.gyro_bias_radps2_rthz", kGyroBias, true},
    DatasheetRow{"accel-instability", "inertial.accel_bias_mps3_rthz", kAccelBias, true},
    DatasheetRow{"gyro-offset", "inertial.gyro_turn_on_radps", kGyroBias, false},
    DatasheetRow{"accel-offset", "inertial.accel_turn_on_mps2", kAccelBias, false},
    DatasheetRow{"gyro-scale", "inertial.gyro_scale", kRatio, false},
};

/// "gyro-noise=2.8mdps/rtHz" as lines of a file for --params. Throws UsageError.
[[nodiscard]] inline std::string datasheet_lines(const std::string& text) {
  const std::string where = "--from-datasheet " + text;
  const std::size_t equals = text.find('=');
  std::string names;
  for (const DatasheetRow& row : kDatasheetRows) {
    names += (names.empty() ? "" : " ") + std::string(row.quantity);
    if (equals == std::string::npos || row.quantity != std::string_view(text).substr(0, equals)) continue;
    double number = 0;
    const char *const begin = text.data() + equals + 1, *const end = text.data() + text.size();
    const auto [rest, error] = std::from_chars(begin, end, number);
    if (error != std::errc{} || !(number > 0))
      throw UsageError(where + ": a number above zero and a unit are needed behind =");
    std::string_view unit(rest, static_cast<std::size_t>(end - rest));
    while (unit.starts_with(' ')) unit.remove_prefix(1);
    std::string units;
    for (const DatasheetUnit& one : row.units) {
      units += (units.empty() ? "" : " ") + std::string(one.name);
      if (one.name != unit) continue;
      constexpr double kLeastAllan = 0.664, kTime_s = 300;
      const double value = number * one.factor * (row.walk ? std::sqrt(2 / kTime_s) / kLeastAllan : 1);
      char line[256];
      std::snprintf(line, sizeof line, "%.*s = %.6g  # %s\n", static_cast<int>(row.path.size()), row.path.data(), value,
                    text.c_str());
      std::string lines = line;
      if (row.path == "inertial.gyro_radps_rthz") {  // of planar robots, its square
        std::snprintf(line, sizeof line, "gyro.noise = %.6g  # the same for planar filters\n", value * value);
        lines += line;
      }
      return lines;
    }
    throw UsageError(where + ": no unit '" + std::string(unit) + "'; there are: " + units);
  }
  throw UsageError(where + ": no such quantity; there are: " + names);
}

}  // namespace tetap::sim
