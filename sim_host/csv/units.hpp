// SPDX-License-Identifier: Apache-2.0
// Units as tables write them, and the factor to those of the bus.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace tetap::csv {

enum class Dimension : std::uint8_t {
  kTime,
  kAngle,
  kAngularRate,
  kAcceleration,
  kSpeed,
  kLength,
  kPlace,  ///< latitude and longitude [deg]
  kFlux,
  kPressure,
  kTemperature,
  kNumber
};

/// value of the bus = factor * number + offset. Units of the bus: rad, rad/s, m/s2, m/s, m, deg (kPlace), uT, Pa, degC.
struct Unit {
  double factor = 1;
  double offset = 0;
  int power = 0;            ///< kTime: 10^power microseconds
  bool minutes = false;     ///< kPlace: ddmm.mmmm, degrees and minutes as NMEA 0183 writes them
  std::string_view name{};  ///< as it is named in the list
};

/// "m/s^2", "m s^-2", "mps2", "°/s", "deg/s", "µT"; a minus before it turns the sign. Nothing for another dimension's.
[[nodiscard]] std::optional<Unit> unit_of(std::string_view text, Dimension dimension);
/// The unit of numbers whose table names none.
[[nodiscard]] Unit usual_unit(Dimension dimension);
/// "rad/s deg/s rpm", for messages.
[[nodiscard]] std::string units_of(Dimension dimension);
/// A line a dimension, "  angular rate  rad/s deg/s rpm", for help.
[[nodiscard]] std::string unit_table();

}  // namespace tetap::csv
