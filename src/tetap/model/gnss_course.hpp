// SPDX-License-Identifier: Apache-2.0
// Course over ground of a body that moves the way it looks: heading for robots without a compass. Its error is that of
// the velocity across, over the speed.
#pragma once

#include "tetap/model/direction.hpp"

namespace tetap::model {

struct GnssCourse : DirectionMeasurement {
  /// From a velocity over ground; not defined at standstill and above 100 km/s (the angle is NaN, the update refuses
  /// it). `slip_rad`: how far the body may look beside its way. The velocity's own error is in it: not to be fused
  /// beside that velocity.
  GnssCourse(float east_mps, float north_mps, float sigma_mps, float slip_rad, bool backwards = false) {
    const float speed2 = east_mps * east_mps + north_mps * north_mps;
    const bool moves = speed2 > sigma_mps * sigma_mps && speed2 < kMost2;
    vector_b = {backwards ? -1.0F : 1.0F, 0.0F, 0.0F};
    angle_rad = moves ? base::atan2(north_mps, east_mps) : base::kNan;
    sigma_rad = moves ? base::sqrt(sigma_mps * sigma_mps / speed2 + slip_rad * slip_rad) : 0.0F;
  }

 private:
  static constexpr float kMost2 = 1e10F;
};

}  // namespace tetap::model
