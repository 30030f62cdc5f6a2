// SPDX-License-Identifier: Apache-2.0
// Facts that every estimator is given with a sample, and the commands it can be sent.
#pragma once

#include "tetap/base/time.hpp"
#include "tetap/estimators/map_frame.hpp"
#include "tetap/model/planar_pose.hpp"
#include "tetap/param/parameters.hpp"
#include "tetap/sensor/image_pool.hpp"
#include "tetap/sensor/scan_pool.hpp"
#include "tetap/slam/likelihood_field.hpp"

namespace tetap::estimators {

struct Context {
  const param::Parameters& parameters;
  const MapFrame& map_frame;
  const sensor::Scans* scans = nullptr;          ///< null: no estimator of the robot takes scans
  sensor::ImagesInWindow images{};               ///< features of the images in the window
  const slam::LikelihoodField* field = nullptr;  ///< the map that a scanner is given; null: none
};

/// A pose from outside. sigma_yaw_rad >= pi (or not available on the bus): the heading is not known.
struct SetPose {
  model::PlanarPose pose;
  float sigma_position_m = 0;
  float sigma_yaw_rad = 0;
  std::uint8_t counter = 0;  ///< counter of the command that carried the pose
  std::uint8_t waited = 0;   ///< ticks since it came
};

/// The pose that the parameters state for the start. It counts where StartParameters::known is not 0.
[[nodiscard]] inline SetPose start_pose(const param::StartParameters& s) {
  return {.pose = {.x = base::Anchored{}.plus(s.x_m), .y = base::Anchored{}.plus(s.y_m), .yaw_rad = s.yaw_rad},
          .sigma_position_m = s.sigma_position_m,
          .sigma_yaw_rad = s.sigma_yaw_rad};
}

}  // namespace tetap::estimators
