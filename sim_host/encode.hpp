// SPDX-License-Identifier: Apache-2.0
// A measurement of the world as the frames that reach the bus.
#pragma once

#include "sim_host/world/measurement.hpp"
#include "tetap/bus/encoder.hpp"

#include <cstdint>
#include <vector>

namespace tetap::sim {

template <class Put>
void encode_sample(const ScanHead& v, const bus::SampleHead& head, Put&& put) {
  put(bus::InScanHead{.stamp_us = head.stamp_us,
                      .seq = head.seq,
                      .inst = head.inst,
                      .count = v.count,
                      .first_rad = static_cast<float>(v.first) / ScanHead::kFirstStepsPerRadian,
                      .step_rad = static_cast<float>(v.step) / ScanHead::kStepsPerRadian});
}

template <class Put>
void encode_sample(const ScanBlock& v, const bus::SampleHead& head, Put&& put) {
  const auto metres = [](std::uint16_t range) { return static_cast<float>(range) / ScanBlock::kStepsPerMetre; };
  put(bus::InScan{.seq = head.seq,
                  .block = v.block,
                  .range0_m = metres(v.ranges[0]),
                  .range1_m = metres(v.ranges[1]),
                  .range2_m = metres(v.ranges[2]),
                  .range3_m = metres(v.ranges[3])});
}

template <class Put>
void encode_sample(const ImageFeature& v, const bus::SampleHead& head, Put&& put) {
  put(bus::InFeature{.stamp_us = head.stamp_us,
                     .seq = head.seq,
                     .inst = head.inst,
                     .track_id = v.track,
                     .u = static_cast<float>(v.u) / ImageFeature::kStepsPerPixel,
                     .v = static_cast<float>(v.v) / ImageFeature::kStepsPerPixel});
}

template <class Put>
void encode_sample(const ImageEnd& v, const bus::SampleHead& head, Put&& put) {
  put(bus::InImage{.stamp_us = head.stamp_us,
                   .seq = head.seq,
                   .inst = head.inst,
                   .count = v.count,
                   .exposure_s = static_cast<float>(v.exposure_10us) / 100'000,
                   .tracker_state = v.tracking ? bus::TrackerState::kTracking : bus::TrackerState::kLost});
}

/// Appends the measurement's frames, but not those that are lost on the way.
inline void encode(std::uint32_t base, const Measurement& m, std::vector<base::CanFrame>& out) {
  int part = 0;
  const auto put = [&](const auto& message, std::size_t instance = 0) {
    if ((m.lost_parts >> part++ & 1) == 0) out.push_back(bus::frame(base, message, instance));
  };
  const auto head = bus::SampleHead::of(m.stamp, m.sequence, m.instance);
  using bus::encode_sample;
  std::visit([&](const auto& value) { encode_sample(value, head, put); }, m.value);
}

}  // namespace tetap::sim
