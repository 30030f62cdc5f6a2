// SPDX-License-Identifier: Apache-2.0
// Output of the world: a sensor's sample with the time it claims and the time it is on the bus. Nothing of the truth is
// in it.
#pragma once

#include "tetap/base/time.hpp"
#include "tetap/sensor/samples.hpp"

#include <array>
#include <cstdint>
#include <variant>

namespace tetap::sim {

/// Begins a scan. Angles are in the steps of the bus, as a scanner's own.
struct ScanHead {
  static constexpr int kFirstStepsPerRadian = 2'000, kStepsPerRadian = 100'000;
  std::uint16_t count = 0;
  std::int16_t first = 0;  ///< bearing of the first beam, anticlockwise
  std::int16_t step = 0;   ///< to the next; below 0: clockwise
};

/// Four ranges of a scan.
struct ScanBlock {
  static constexpr int kStepsPerMetre = 200;
  std::uint8_t block = 0;
  std::array<std::uint16_t, 4> ranges{};  ///< [5 mm]; 0: none
};

/// A feature of an image, in pixels of an ideal pinhole camera.
struct ImageFeature {
  static constexpr int kStepsPerPixel = 4;
  std::uint16_t track = 0;
  std::uint16_t u = 0, v = 0;  ///< column and row [1/4 px]
};

/// Ends an image.
struct ImageEnd {
  std::uint8_t count = 0;  ///< number of its features
  std::uint16_t exposure_10us = 0;
  bool tracking = true;  ///< false: the front end follows nothing
};

using Value = std::variant<sensor::ImuSample, sensor::WheelCounts, sensor::WheelSpeeds, sensor::BodySpeed,
                           sensor::GnssPosition, sensor::GnssVelocity, sensor::LandmarkSighting, sensor::MagneticFlux,
                           sensor::AirPressure, sensor::LoopClosure, ScanHead, ScanBlock, ImageFeature, ImageEnd>;

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
/// identities, displacement, sigmas, correlations; one. A scan and an image are measurements of a frame each.
[[nodiscard]] constexpr int parts(const Value& value) {
  if (std::holds_alternative<sensor::ImuSample>(value)) return 3;
  if (std::holds_alternative<sensor::GnssPosition>(value)) return 4;
  if (std::holds_alternative<sensor::LoopClosure>(value)) return 4;
  if (std::holds_alternative<sensor::GnssVelocity>(value)) return 2;
  return 1;
}

}  // namespace tetap::sim
