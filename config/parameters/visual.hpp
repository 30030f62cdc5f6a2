// SPDX-License-Identifier: Apache-2.0
// Parameters of the robot visual (config/visual.hpp).
#pragma once

#include "config/parameters/rover.hpp"
#include "tetap/param/limits.hpp"

namespace tetap::robot::visual {

inline constexpr param::Parameters parameters = param::checked([] {
  param::Parameters n = rover::parameters;
  n.loop.work_units = 2'000;
  n.gnss = {};
  n.publish = {};
  n.wired = {.imu = 1, .encoders = 1};
  // 640 x 480 pixels, 70 degrees wide, above the front axle.
  n.camera = {.fu_px = 458, .fv_px = 458, .cu_px = 319.5F, .cv_px = 239.5F, .position_b_m = {0.2F, 0.0F, 0.3F}};
  return n;
}());

}  // namespace tetap::robot::visual
