// SPDX-License-Identifier: Apache-2.0
#include "sim_host/csv/units.hpp"

#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>

namespace tetap::csv {

namespace {

constexpr double kDegree = std::numbers::pi / 180, kGravity_mps2 = 9.80665, kKnot_mps = 1852.0 / 3600;
constexpr double kMile_m = 1609.344, kFoot_m = 0.3048;

/// `spelling`: what is left of the text without blanks, marks and capitals.
struct Row {
  std::string_view spelling;
  Dimension dimension;
  Unit unit;
};
using enum Dimension;
constexpr auto kRows = std::to_array<Row>({
    {"s", kTime, {.power = 6, .name = "s"}},
    {"sec", kTime, {.power = 6, .name = "s"}},
    {"secs", kTime, {.power = 6, .name = "s"}},
    {"second", kTime, {.power = 6, .name = "s"}},
    {"seconds", kTime, {.power = 6, .name = "s"}},
    {"ms", kTime, {.power = 3, .name = "ms"}},
    {"msec", kTime, {.power = 3, .name = "ms"}},
    {"millis", kTime, {.power = 3, .name = "ms"}},
    {"milliseconds", kTime, {.power = 3, .name = "ms"}},
    {"us", kTime, {.power = 0, .name = "us"}},
    {"usec", kTime, {.power = 0, .name = "us"}},
    {"micros", kTime, {.power = 0, .name = "us"}},
    {"microseconds", kTime, {.power = 0, .name = "us"}},
    {"ns", kTime, {.power = -3, .name = "ns"}},
    {"nsec", kTime, {.power = -3, .name = "ns"}},
    {"nanos", kTime, {.power = -3, .name = "ns"}},
    {"nanoseconds", kTime, {.power = -3, .name = "ns"}},
    {"rad", kAngle, {.name = "rad"}},
    {"radian", kAngle, {.name = "rad"}},
    {"radians", kAngle, {.name = "rad"}},
    {"deg", kAngle, {.factor = kDegree, .name = "deg"}},
    {"degree", kAngle, {.factor = kDegree, .name = "deg"}},
    {"degrees", kAngle, {.factor = kDegree, .name = "deg"}},
    {"mrad", kAngle, {.factor = 1e-3, .name = "mrad"}},
    {"rad/s", kAngularRate, {.name = "rad/s"}},
    {"rad", kAngularRate, {.name = "rad/s"}},
    {"rads", kAngularRate, {.name = "rad/s"}},
    {"rads-1", kAngularRate, {.name = "rad/s"}},
    {"radps", kAngularRate, {.name = "rad/s"}},
    {"rad/sec", kAngularRate, {.name = "rad/s"}},
    {"deg/s", kAngularRate, {.factor = kDegree, .name = "deg/s"}},
    {"degs", kAngularRate, {.factor = kDegree, .name = "deg/s"}},
    {"degs-1", kAngularRate, {.factor = kDegree, .name = "deg/s"}},
    {"degps", kAngularRate, {.factor = kDegree, .name = "deg/s"}},
    {"deg/sec", kAngularRate, {.factor = kDegree, .name = "deg/s"}},
    {"dps", kAngularRate, {.factor = kDegree, .name = "deg/s"}},
    {"mdps", kAngularRate, {.factor = 1e-3 * kDegree, .name = "mdps"}},
    {"mrad/s", kAngularRate, {.factor = 1e-3, .name = "mrad/s"}},
    {"rpm", kAngularRate, {.factor = 6 * kDegree, .name = "rpm"}},
    {"m/s2", kAcceleration, {.name = "m/s2"}},
    {"m/s/s", kAcceleration, {.name = "m/s2"}},
    {"ms2", kAcceleration, {.name = "m/s2"}},
    {"ms-2", kAcceleration, {.name = "m/s2"}},
    {"mps2", kAcceleration, {.name = "m/s2"}},
    {"mss", kAcceleration, {.name = "m/s2"}},
    {"g", kAcceleration, {.factor = kGravity_mps2, .name = "g"}},
    {"gs", kAcceleration, {.factor = kGravity_mps2, .name = "g"}},
    {"mg", kAcceleration, {.factor = 1e-3 * kGravity_mps2, .name = "mg"}},
    {"cm/s2", kAcceleration, {.factor = 1e-2, .name = "cm/s2"}},
    {"m/s", kSpeed, {.name = "m/s"}},
    {"ms", kSpeed, {.name = "m/s"}},
    {"ms-1", kSpeed, {.name = "m/s"}},
    {"mps", kSpeed, {.name = "m/s"}},
    {"km/h", kSpeed, {.factor = 1 / 3.6, .name = "km/h"}},
    {"kmh", kSpeed, {.factor = 1 / 3.6, .name = "km/h"}},
    {"kmph", kSpeed, {.factor = 1 / 3.6, .name = "km/h"}},
    {"kph", kSpeed, {.factor = 1 / 3.6, .name = "km/h"}},
    {"kn", kSpeed, {.factor = kKnot_mps, .name = "knots"}},
    {"kt", kSpeed, {.factor = kKnot_mps, .name = "knots"}},
    {"kts", kSpeed, {.factor = kKnot_mps, .name = "knots"}},
    {"knot", kSpeed, {.factor = kKnot_mps, .name = "knots"}},
    {"knots", kSpeed, {.factor = kKnot_mps, .name = "knots"}},
    {"mph", kSpeed, {.factor = kMile_m / 3600, .name = "mph"}},
    {"ft/s", kSpeed, {.factor = kFoot_m, .name = "ft/s"}},
    {"cm/s", kSpeed, {.factor = 1e-2, .name = "cm/s"}},
    {"mm/s", kSpeed, {.factor = 1e-3, .name = "mm/s"}},
    {"m", kLength, {.name = "m"}},
    {"meter", kLength, {.name = "m"}},
    {"meters", kLength, {.name = "m"}},
    {"metres", kLength, {.name = "m"}},
    {"km", kLength, {.factor = 1e3, .name = "km"}},
    {"cm", kLength, {.factor = 1e-2, .name = "cm"}},
    {"mm", kLength, {.factor = 1e-3, .name = "mm"}},
    {"ft", kLength, {.factor = kFoot_m, .name = "ft"}},
    {"feet", kLength, {.factor = kFoot_m, .name = "ft"}},
    {"deg", kPlace, {.name = "deg"}},
    {"degree", kPlace, {.name = "deg"}},
    {"degrees", kPlace, {.name = "deg"}},
    {"wgs84", kPlace, {.name = "deg"}},
    {"rad", kPlace, {.factor = 1 / kDegree, .name = "rad"}},
    {"radians", kPlace, {.factor = 1 / kDegree, .name = "rad"}},
    {"e7", kPlace, {.factor = 1e-7, .name = "e7"}},
    {"1e7", kPlace, {.factor = 1e-7, .name = "e7"}},
    {"1e-7deg", kPlace, {.factor = 1e-7, .name = "e7"}},
    {"dege7", kPlace, {.factor = 1e-7, .name = "e7"}},
    {"ddmm.mmmm", kPlace, {.minutes = true, .name = "ddmm.mmmm"}},
    {"nmea", kPlace, {.minutes = true, .name = "ddmm.mmmm"}},
    {"ut", kFlux, {.name = "uT"}},
    {"microtesla", kFlux, {.name = "uT"}},
    {"nt", kFlux, {.factor = 1e-3, .name = "nT"}},
    {"mt", kFlux, {.factor = 1e3, .name = "mT"}},
    {"t", kFlux, {.factor = 1e6, .name = "T"}},
    {"tesla", kFlux, {.factor = 1e6, .name = "T"}},
    {"g", kFlux, {.factor = 1e2, .name = "gauss"}},
    {"gauss", kFlux, {.factor = 1e2, .name = "gauss"}},
    {"ga", kFlux, {.factor = 1e2, .name = "gauss"}},
    {"mg", kFlux, {.factor = 1e-1, .name = "mgauss"}},
    {"mgauss", kFlux, {.factor = 1e-1, .name = "mgauss"}},
    {"pa", kPressure, {.name = "Pa"}},
    {"hpa", kPressure, {.factor = 1e2, .name = "hPa"}},
    {"mbar", kPressure, {.factor = 1e2, .name = "hPa"}},
    {"kpa", kPressure, {.factor = 1e3, .name = "kPa"}},
    {"bar", kPressure, {.factor = 1e5, .name = "bar"}},
    {"degc", kTemperature, {.name = "degC"}},
    {"c", kTemperature, {.name = "degC"}},
    {"celsius", kTemperature, {.name = "degC"}},
    {"k", kTemperature, {.offset = -273.15, .name = "K"}},
    {"degf", kTemperature, {.factor = 5.0 / 9, .offset = -160.0 / 9, .name = "degF"}},
    {"1", kNumber, {.name = "1"}},
    {"count", kNumber, {.name = "1"}},
    {"counts", kNumber, {.name = "1"}},
    {"ticks", kNumber, {.name = "1"}},
});

/// Small letters and digits without blanks, ^ and *; signs of other alphabets in those of this one.
std::string spelled(std::string_view text) {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 10> kSigns{{{"°", "deg"},
                                                                                  {"º", "deg"},
                                                                                  {"µ", "u"},
                                                                                  {"μ", "u"},
                                                                                  {"²", "2"},
                                                                                  {"⁻", "-"},
                                                                                  {"¹", "1"},
                                                                                  {"·", ""},
                                                                                  {"⋅", ""},
                                                                                  {"**", ""}}};
  std::string plain;
  while (!text.empty()) {
    bool sign = false;
    for (const auto& [from, to] : kSigns) {
      if (!text.starts_with(from)) continue;
      plain += to;
      text.remove_prefix(from.size());
      sign = true;
      break;
    }
    if (sign) continue;
    const char c = text.front();
    text.remove_prefix(1);
    if (c == ' ' || c == '^' || c == '*' || c == '_') continue;
    plain += c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  }
  return plain;
}

}  // namespace

std::optional<Unit> unit_of(std::string_view text, Dimension dimension) {
  const bool turned = text.starts_with('-');
  if (turned) text.remove_prefix(1);
  const std::string plain = spelled(text);
  for (const Row& row : kRows) {
    if (row.dimension != dimension || row.spelling != plain) continue;
    Unit unit = row.unit;
    if (turned) {
      unit.factor = -unit.factor;
      unit.offset = -unit.offset;
    }
    return unit;
  }
  return std::nullopt;
}

Unit usual_unit(Dimension dimension) {
  for (const Row& row : kRows)
    if (row.dimension == dimension && std::abs(row.unit.factor - 1) < 1e-12 && std::abs(row.unit.offset) < 1e-12)
      return row.unit;
  return {};
}

std::string units_of(Dimension dimension) {
  std::string names;
  std::string_view before;
  for (const Row& row : kRows) {
    if (row.dimension != dimension || row.unit.name == before) continue;
    before = row.unit.name;
    names += (names.empty() ? "" : " ") + std::string(before);
  }
  return names;
}

std::string unit_table() {
  constexpr std::array<std::pair<std::string_view, Dimension>, 10> kNames{{{"time", kTime},
                                                                           {"angle", kAngle},
                                                                           {"rate", kAngularRate},
                                                                           {"force", kAcceleration},
                                                                           {"speed", kSpeed},
                                                                           {"length", kLength},
                                                                           {"place", kPlace},
                                                                           {"flux", kFlux},
                                                                           {"pressure", kPressure},
                                                                           {"temperature", kTemperature}}};
  std::string lines;
  for (const auto& [name, dimension] : kNames)
    lines += "  " + std::string(name) + std::string(13 - name.size(), ' ') + units_of(dimension) + '\n';
  return lines;
}

}  // namespace tetap::csv
