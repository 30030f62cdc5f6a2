// SPDX-License-Identifier: Apache-2.0
// The rover of rover.hpp with inertial navigation in place of the planar filter: IMU, wheels and GNSS, no landmarks.
#pragma once

#include "app/estimators/inertial.hpp"
#include "app/estimators/odometry.hpp"
#include "app/node.hpp"
#include "app/numbers_check.hpp"
#include "config/rover.hpp"

namespace tetap::robot::rover_inertial {

using Estimators = app::Estimators<app::Odometry, app::Inertial>;

inline constexpr app::Numbers numbers = app::checked([] {
  app::Numbers n = rover::numbers;
  // The vibration of a wheeled robot is far above the data sheet's noise.
  n.inertial = {.gyro_radps_rthz = 5e-4F, .accel_mps2_rthz = 2e-2F};
  // Without landmarks the plane is only as well known as its origin: surveyed here, not the first fix.
  n.gnss.origin_configured = 1;
  n.gnss.origin_latitude_2ndeg = 24'131'350'000;
  n.gnss.origin_longitude_2ndeg = 5'834'150'000;
  n.gnss.origin_height_m = 520;
  return n;
}());

}  // namespace tetap::robot::rover_inertial
