// SPDX-License-Identifier: Apache-2.0
// Any sample with its stamp and identity: what the timeline holds and orders.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/sensor/samples.hpp"
#include "tetap/sensor/vocabulary.hpp"

#include <compare>
#include <cstdint>

namespace tetap::sensor {

struct Sample {
  base::Micros stamp;
  sensor::Sensor sensor = sensor::Sensor::kNotAvailable;  ///< kind of sensor, and by it the member of the payload
  std::uint8_t instance = 0;
  std::uint8_t sequence = 0;
  std::uint8_t detail = 0;  ///< separates sightings of one sensor at one moment: the landmark
  std::uint32_t bits = 0;   ///< sum of the CRC-32 of the frames it came in: stands for the payload in hashes

  union Payload {
    constexpr Payload() : imu{} {}
    ImuSample imu;
    WheelCounts counts;
    WheelSpeeds wheel_speeds;
    BodySpeed body_speed;
    GnssPosition gnss_position;
    GnssVelocity gnss_velocity;
    LandmarkSighting sighting;
    MagneticFlux magnetic;
    AirPressure pressure;
    OutsideHeading heading;
    LoopClosure closure;
    RelativePose relative;
    PlanarScan scan;
    CameraImage image;
  } payload;

  static_assert(sizeof(Payload) == 32, "a window of them is most of the memory");

  static constexpr auto members(auto& self) {
    return base::members(self.stamp, self.sensor, self.instance, self.sequence, self.detail, self.bits,
                         base::active(self, self.payload));
  }

  /// The order in which samples are consumed, whatever the order of arrival.
  [[nodiscard]] constexpr std::strong_ordering order(const Sample& other) const {
    if (const auto by = stamp <=> other.stamp; by != 0) return by;
    if (const auto by = sensor <=> other.sensor; by != 0) return by;
    if (const auto by = instance <=> other.instance; by != 0) return by;
    if (const auto by = sequence <=> other.sequence; by != 0) return by;
    return detail <=> other.detail;
  }
};

[[nodiscard]] constexpr bool is_imu(const Sample& sample, std::int32_t instance) {
  return sample.sensor == sensor::Sensor::kImu && sample.instance == instance;
}

/// Calls f with the payload that is there; false when there is none.
template <class F>
constexpr bool visit(const Sample& sample, F&& f) {
  switch (sample.sensor) {
    case sensor::Sensor::kImu:
      f(sample.payload.imu);
      return true;
    case sensor::Sensor::kWheelCounts:
      f(sample.payload.counts);
      return true;
    case sensor::Sensor::kWheelSpeed:
      f(sample.payload.wheel_speeds);
      return true;
    case sensor::Sensor::kBodySpeed:
      f(sample.payload.body_speed);
      return true;
    case sensor::Sensor::kRangeBearing:
      f(sample.payload.sighting);
      return true;
    case sensor::Sensor::kGnssPosition:
      f(sample.payload.gnss_position);
      return true;
    case sensor::Sensor::kGnssVelocity:
      f(sample.payload.gnss_velocity);
      return true;
    case sensor::Sensor::kMagnetometer:
      f(sample.payload.magnetic);
      return true;
    case sensor::Sensor::kBarometer:
      f(sample.payload.pressure);
      return true;
    case sensor::Sensor::kHeading:
      f(sample.payload.heading);
      return true;
    case sensor::Sensor::kClosure:
      f(sample.payload.closure);
      return true;
    case sensor::Sensor::kFeature:
      f(sample.payload.image);
      return true;
    case sensor::Sensor::kScan:
      f(sample.payload.scan);
      return true;
    case sensor::Sensor::kRelativePose:
      f(sample.payload.relative);
      return true;
    case sensor::Sensor::kNotAvailable:
      return false;
  }
  return false;
}

}  // namespace tetap::sensor
