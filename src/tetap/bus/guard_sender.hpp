// SPDX-License-Identifier: Apache-2.0
// For senders: the guard of each sample whose last frame has just been sent (bus/guard.hpp).
#pragma once

#include "tetap/bus/guard.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace tetap::bus {

class GuardSender {
 public:
  /// Empty where the frame is no part of a guarded sample, or not its last one. A sample's frames are sent in a row,
  /// others of its kind not between them.
  [[nodiscard]] std::optional<InGuardSample> after(std::uint8_t offset, const base::CanFrame& frame) {
    SamplePart part = part_of(offset, frame);
    if (part.part == 0xFF) return std::nullopt;
    if (offset == InScan::kOffset) part.instance = scan_instance_;
    if (offset == InScanHead::kOffset) {
      scan_instance_ = part.instance;
      scan_blocks_ = (decode<InScanHead>(payload(frame)).value_or(InScanHead{}).count + 3) / 4;
    }
    Sensor& sensor = sensors_[guarded_place(part.sensor, part.instance)];
    if (sensor.sequence != part.sequence) sensor = {.sequence = part.sequence, .counter = sensor.counter};
    sensor.sum = static_cast<std::uint16_t>(sensor.sum + guard_crc(offset, payload(frame)));
    if (part.part == SamplePart::kRepeated) return std::nullopt;
    if (++sensor.parts < (part.sensor == sensor::Sensor::kScan ? 1 + scan_blocks_ : parts_of(part.sensor)))
      return std::nullopt;
    InGuardSample guard{
        .sensor = part.sensor, .sample_inst = part.instance, .sample_seq = part.sequence, .sample_ctr = sensor.counter};
    guard.sample_crc = sample_guard_crc(guard, sensor.sum);
    sensor = {.sequence = 0xFF, .counter = static_cast<std::uint8_t>(sensor.counter + 1)};
    return guard;
  }

 private:
  struct Sensor {
    std::uint16_t sum = 0;         ///< sum of the frames' checksums
    std::uint16_t parts = 0;       ///< number of frames sent
    std::uint8_t sequence = 0xFF;  ///< sequence number of the sample; 0xFF: none
    std::uint8_t counter = 0;
  };
  [[nodiscard]] static constexpr std::uint8_t parts_of(sensor::Sensor sensor) {
    return sensor == sensor::Sensor::kImu            ? 3
           : sensor == sensor::Sensor::kGnssPosition ? 4
           : sensor == sensor::Sensor::kGnssVelocity ? 2
                                                     : 1;
  }

  std::array<Sensor, kGuardedSamples> sensors_{};
  int scan_blocks_ = 0;  ///< blocks of the latest scan that began
  std::uint8_t scan_instance_ = 0;
};

}  // namespace tetap::bus
