// SPDX-License-Identifier: Apache-2.0
// A measurement of the world as the frames that reach the bus.
#pragma once

#include "sim_host/world/measurement.hpp"
#include "tetap/bus/encoder.hpp"

#include <cstdint>
#include <vector>

namespace tetap::sim {

/// Appends the measurement's frames, but not those that are lost on the way.
inline void encode(std::uint32_t base, const Measurement& m, std::vector<base::CanFrame>& out) {
  int part = 0;
  const auto put = [&](const auto& message, std::size_t instance = 0) {
    if ((m.lost_parts >> part++ & 1) == 0) out.push_back(bus::frame(base, message, instance));
  };
  const auto head = bus::SampleHead::of(m.stamp, m.sequence, m.instance);
  std::visit([&](const auto& value) { bus::encode_sample(value, head, put); }, m.value);
}

}  // namespace tetap::sim
