// SPDX-License-Identifier: Apache-2.0
// Unicycle: forward speed and yaw rate held over a step, each with white noise of a stated density. Thrun, Burgard, Fox
// 2005, sec. 5.3 and 7.4: noise in control space, which grows with the motion.
#pragma once

#include "tetap/model/planar_increment.hpp"

namespace tetap::model {

/// Densities: the variance gathered per second.
struct UnicycleNoise {
  float speed = 0;                  ///< m^2/s at standstill
  float speed_per_speed = 0;        ///< m^2/s per m/s: grows with |v|
  float yaw_rate = 0;               ///< rad^2/s at standstill
  float yaw_rate_per_yaw_rate = 0;  ///< rad^2/s per rad/s
  float yaw_rate_per_speed = 0;     ///< rad^2/s per m/s
};

struct Unicycle {
  float forward_mps = 0;
  float yaw_rate_radps = 0;
  UnicycleNoise noise;

  [[nodiscard]] constexpr PlanarIncrement increment(float dt_s) const {
    const float v = forward_mps < 0 ? -forward_mps : forward_mps;
    const float w = yaw_rate_radps < 0 ? -yaw_rate_radps : yaw_rate_radps;
    return {.ds_m = forward_mps * dt_s,
            .dyaw_rad = yaw_rate_radps * dt_s,
            .var_ds = (noise.speed + noise.speed_per_speed * v) * dt_s,
            .cov_ds_dyaw = 0.0F,
            .var_dyaw = (noise.yaw_rate + noise.yaw_rate_per_yaw_rate * w + noise.yaw_rate_per_speed * v) * dt_s};
  }
};

}  // namespace tetap::model
