// SPDX-License-Identifier: Apache-2.0
// Motion of the body as sensors and judges see it.
#pragma once

#include "sim_host/world/rotation.hpp"
#include "tetap/base/time.hpp"

namespace tetap::sim {

/// Frames: n = east north up of an origin, b = forward left up (rotation.hpp).
struct Truth {
  base::Micros time;
  double x_m = 0, y_m = 0, z_m = 0;
  double roll_rad = 0, pitch_rad = 0, yaw_rad = 0;  ///< yaw in [-pi, pi)
  double speed_mps = 0;                             ///< forward
  double yaw_rate_radps = 0;
  Vector3 rate_b_radps{};  ///< turn rate of b against n, in b
  Vector3 v_n_mps{};
  Vector3 gyro_bias_b_radps{};  ///< excess of the IMU's readings, in its own axes
  Vector3 accel_bias_b_mps2{};  ///< likewise, level and at rest: the share of gravity in it that its scale error makes
};

/// One step of the world, at its middle.
struct Motion {
  Vector3 rate_b_radps{};  ///< rate of b against n, in b
  Vector3 acceleration_n_mps2{};
  Vector3 attitude_rad{};  ///< roll, pitch, yaw
  double rim_left_m = 0;   ///< travel of the wheels' rims: what they turned times their true radius
  double rim_right_m = 0;
  Vector3 position_n_m{};
  Vector3 velocity_n_mps{};
  double shaking_mps = 0;  ///< speed of what shakes the IMU: tyres on the ground, rotors in the air
};

/// Pose to which a driver or pilot has brought the body: a control point of its path.
struct Pose {
  Vector3 position_n_m{};
  Vector3 attitude_rad{};  ///< yaw continuous: two turns to the left add 4 pi
};

/// A rigid motion in the plane: turned about `from`, then set down at `to`.
struct PlanarMove {
  double from_x_m = 0, from_y_m = 0, to_x_m = 0, to_y_m = 0, turn_rad = 0;

  void apply(double& x_m, double& y_m) const {
    const Direction d = direction(turn_rad);
    const double dx = x_m - from_x_m, dy = y_m - from_y_m;
    x_m = to_x_m + d.cos * dx - d.sin * dy;
    y_m = to_y_m + d.sin * dx + d.cos * dy;
  }
};

}  // namespace tetap::sim
