// SPDX-License-Identifier: Apache-2.0
// Output of the world: a sensor's sample with the time it claims and the time it is on the bus. Nothing of the truth is
// in it.
#pragma once

#include "tetap/base/time.hpp"
#include "tetap/sensor/samples.hpp"

#include <cstdint>
#include <variant>

namespace tetap::sim {

using Value = std::variant<sensor::ImuSample, sensor::WheelCounts, sensor::WheelSpeeds, sensor::BodySpeed,
                           sensor::GnssPosition, sensor::GnssVelocity, sensor::LandmarkSighting, sensor::MagneticFlux,
                           sensor::AirPressure, sensor::LoopClosure>;

struct Measurement {
  base::Micros stamp;
  base::Micros arrival;
  std::uint8_t instance = 0;
  std::uint8_t sequence = 0;  ///< counts per kind of value; the sender sends the low 4 bits
  std::uint8_t lost_parts =
      0;  ///< bit i: its i-th frame is lost on the way (fault lost_frames); the sender leaves it out
  Value value;
};

/// In how many frames a value travels: gyro, accel, time; latitude, longitude, height, accuracy; east and north, up;
/// identities, displacement, sigmas, correlations; one.
[[nodiscard]] constexpr int parts(const Value& value) {
  if (std::holds_alternative<sensor::ImuSample>(value)) return 3;
  if (std::holds_alternative<sensor::GnssPosition>(value)) return 4;
  if (std::holds_alternative<sensor::LoopClosure>(value)) return 4;
  if (std::holds_alternative<sensor::GnssVelocity>(value)) return 2;
  return 1;
}

}  // namespace tetap::sim
