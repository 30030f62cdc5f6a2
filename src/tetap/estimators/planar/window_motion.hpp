// SPDX-License-Identifier: Apache-2.0
// Motion from the far end of the fusion window to the present, by the samples in it.
#pragma once

#include "tetap/param/parameters.hpp"
#include "tetap/sensor/window.hpp"

namespace tetap::estimators {

/// Every sample of the window that moves a pose, in the order of stamps. Motion: PlanarDeadReckoning.
template <class Motion>
void move_through(const sensor::Window& window, Motion& motion, const param::Parameters& n) {
  for (std::size_t i = 0; i < window.size(); ++i) {
    const sensor::Sample& sample = window[i];
    if (sample.sensor == sensor::Sensor::kImu && !is_imu(sample, n.inertial.imu)) continue;
    visit(sample, [&](const auto& payload) {
      if constexpr (requires { motion.fuse(payload, sample.stamp, n); })
        static_cast<void>(motion.fuse(payload, sample.stamp, n));
    });
  }
}

}  // namespace tetap::estimators
