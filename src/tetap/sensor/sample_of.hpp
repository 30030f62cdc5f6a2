// SPDX-License-Identifier: Apache-2.0
// A sample from a payload: its type names the kind of sensor.
#pragma once

#include "tetap/sensor/sample.hpp"

namespace tetap::sensor {

namespace detail {
struct Put {
  Sample& to;

  void operator()(const ImuSample& s) const { to.sensor = Sensor::kImu, to.payload.imu = s; }
  void operator()(const WheelCounts& s) const { to.sensor = Sensor::kWheelCounts, to.payload.counts = s; }
  void operator()(const WheelSpeeds& s) const { to.sensor = Sensor::kWheelSpeed, to.payload.wheel_speeds = s; }
  void operator()(const BodySpeed& s) const { to.sensor = Sensor::kBodySpeed, to.payload.body_speed = s; }
  void operator()(const GnssPosition& s) const { to.sensor = Sensor::kGnssPosition, to.payload.gnss_position = s; }
  void operator()(const GnssVelocity& s) const { to.sensor = Sensor::kGnssVelocity, to.payload.gnss_velocity = s; }
  void operator()(const LandmarkSighting& s) const {
    to.sensor = Sensor::kRangeBearing, to.payload.sighting = s, to.detail = s.landmark;
  }
  void operator()(const MagneticFlux& s) const { to.sensor = Sensor::kMagnetometer, to.payload.magnetic = s; }
  void operator()(const AirPressure& s) const { to.sensor = Sensor::kBarometer, to.payload.pressure = s; }
  void operator()(const OutsideHeading& s) const { to.sensor = Sensor::kHeading, to.payload.heading = s; }
  void operator()(const LoopClosure& s) const { to.sensor = Sensor::kClosure, to.payload.closure = s; }
  void operator()(const RelativePose& s) const { to.sensor = Sensor::kRelativePose, to.payload.relative = s; }
  void operator()(const CameraImage& s) const { to.sensor = Sensor::kFeature, to.payload.image = s; }
  void operator()(const PlanarScan& s) const { to.sensor = Sensor::kScan, to.payload.scan = s; }
};
}  // namespace detail

/// A payload of sensor/samples.hpp.
template <class T>
concept Measurement = requires(const detail::Put& put, const T& payload) {
  put(payload);
};

/// `instance` separates sensors of one kind, `sequence` samples of one sensor that have the same stamp.
template <Measurement T>
[[nodiscard]] Sample sample_of(const T& payload, base::Micros stamp, std::uint8_t instance = 0,
                               std::uint8_t sequence = 0) {
  Sample sample;
  sample.stamp = stamp;
  sample.instance = instance;
  sample.sequence = sequence;
  detail::Put{sample}(payload);
  return sample;
}

}  // namespace tetap::sensor
