// SPDX-License-Identifier: Apache-2.0
// What a column may hold, and the guess at it from the column's name, its unit and the file's name.
#pragma once

#include "sim_host/csv/units.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace tetap::csv {

/// A sensor: its quantities come in one row.
enum class Kind : std::uint8_t {
  kTime,
  kGyro,
  kAccel,    ///< specific force: +9.81 upwards at rest
  kLinear,   ///< acceleration without gravity, as telephones work it out
  kGravity,  ///< the part they take away for it
  kMag,
  kBaro,
  kFix,
  kVelocity,
  kWheelSpeed,
  kWheelCounts,
  kBody,
  kHeading,
  kSighting
};
inline constexpr std::size_t kKinds = 14, kMostSlots = 7;

struct Quantity {
  std::string_view name;  ///< "accel.x"
  Kind kind;
  std::size_t slot;  ///< place in the kind's row
  Dimension dimension;
};

[[nodiscard]] std::span<const Quantity> quantities();
/// Null where there is none of that name.
[[nodiscard]] const Quantity* find_quantity(std::string_view name);
/// "gyro", the name before the dot.
[[nodiscard]] std::string_view kind_name(Kind kind);
[[nodiscard]] std::size_t slots_of(Kind kind);

/// The quantity of a column, as far as its name shows.
struct Guess {
  const Quantity* quantity = nullptr;
  std::string unit;  ///< as the name has it; empty: none
  int rank = 0;      ///< the lowest of several columns of one quantity is taken
};

/// `phone`: the table has the column seconds_elapsed of Sensor Logger, whose "Accelerometer" is without gravity.
/// `placed`: the table has latitudes, so that a speed is a receiver's.
[[nodiscard]] std::optional<Guess> guess_column(std::string_view column, std::string_view stem, bool phone,
                                                bool placed);

}  // namespace tetap::csv
