// SPDX-License-Identifier: Apache-2.0
// Pose and covariance that a command or the parameters state, for estimators that make a map.
#pragma once

#include "tetap/estimators/context.hpp"
#include "tetap/estimators/estimate.hpp"

namespace tetap::estimators {

/// Independent place (both axes) and heading. Sigmas below half a step of the bus are that half step. A sigma of the
/// heading from pi on, or none, stands for an unknown one.
[[nodiscard]] inline filter::Symmetric<float, 3> covariance_of_pose(float sigma_position_m, float sigma_yaw_rad) {
  constexpr float kFinest_m = 0.5e-3F, kFinest_rad = 0.1e-3F;
  const bool heading = sigma_yaw_rad < 3.14F;  // false for NaN too
  const float place_m = sigma_position_m > kFinest_m ? sigma_position_m : kFinest_m;
  const float yaw_rad = !heading ? kUnknown_rad : sigma_yaw_rad > kFinest_rad ? sigma_yaw_rad : kFinest_rad;
  return filter::Symmetric<float, 3>::diagonal({place_m * place_m, place_m * place_m, yaw_rad * yaw_rad});
}

/// Where a map begins: the pose of the parameters where that is known, else the origin with certainty.
struct MapStart {
  model::PlanarPose pose;
  filter::Symmetric<float, 3> p;

  explicit MapStart(const param::StartParameters& s) : p(covariance_of_pose(0.0F, 0.0F)) {
    if (s.known == 0) return;
    pose = start_pose(s).pose;
    p = covariance_of_pose(s.sigma_position_m, s.sigma_yaw_rad);
  }
};

}  // namespace tetap::estimators
