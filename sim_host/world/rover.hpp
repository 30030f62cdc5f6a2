// SPDX-License-Identifier: Apache-2.0
// The rover itself: a driver who follows the plan, body dynamics with lag, lean and side slip, and wheels that slip.
// Integrated at 2 kHz or a multiple. Driver: Kanayama et al., "A stable tracking control method for an autonomous
// mobile robot", ICRA 1990, eq. 5.
#pragma once

#include "base/time.hpp"
#include "sim_host/world/chance.hpp"
#include "sim_host/world/course.hpp"
#include "sim_host/world/numbers.hpp"

#include <array>

namespace tetap::sim {

using Vector3 = std::array<double, 3>;

/// Frames: n = east north up from the course's origin, b = forward left up. R_nb = Rz(yaw) Ry(pitch) Rx(roll): pitch is
/// nose down.
struct Truth {
  base::Micros time;
  double x_m = 0, y_m = 0, z_m = 0;
  double roll_rad = 0, pitch_rad = 0, yaw_rad = 0;  ///< yaw in [-pi, pi)
  double speed_mps = 0;                             ///< forward
  double yaw_rate_radps = 0;
  Vector3 v_n_mps{};
  Vector3 gyro_bias_b_radps{};  ///< error of the IMU's rates: shown minus true
  Vector3 accel_bias_b_mps2{};  ///< likewise, level and at rest: the share of gravity in it that its scale error makes
};

/// Between the start and the end of one step.
struct Motion {
  Vector3 rate_b_radps{};  ///< rate of b against n, in b
  Vector3 acceleration_n_mps2{};
  Vector3 attitude_rad{};  ///< roll, pitch, yaw in the middle
  double rim_left_m = 0;   ///< travel of the wheels' rims: what they turned times their true radius
  double rim_right_m = 0;
};

/// R_nb^T v: from n into b.
[[nodiscard]] Vector3 to_body(const Vector3& attitude_rad, const Vector3& v_n);
/// R_nb v: from b into n.
[[nodiscard]] Vector3 to_level(const Vector3& attitude_rad, const Vector3& v_b);

class Rover {
 public:
  static constexpr base::Micros kStep{
      500};  ///< random processes and sensors live on this grid, whatever the integration rate

  /// `substeps` integration steps per kStep.
  Rover(const RoverNumbers& parameters, const Plan& plan, std::uint64_t seed, int substeps);

  /// Advances by kStep; `since_start` is the time at its end.
  Motion step(base::Micros since_start);
  /// Set down elsewhere: where the plan is, now that it has jumped ahead.
  void place(const PathPoint& at);
  /// How far ahead of time the plan is driven (kidnapping along the course).
  void set_ahead(base::Micros ahead) { ahead_ = ahead; }
  [[nodiscard]] base::Micros ahead() const { return ahead_; }
  [[nodiscard]] Truth truth() const;

 private:
  void drive(base::Micros since_start);
  void shake();
  void integrate(double h_s, Motion& motion);
  void jitter();

  RoverNumbers parameters_;
  const Plan* plan_;
  int substeps_;
  base::Micros ahead_;
  double track_m_;

  double x_m_, y_m_, yaw_rad_;  // yaw is continuous
  double speed_mps_ = 0, acceleration_mps2_ = 0, yaw_rate_radps_ = 0;
  double roll_rad_ = 0, roll_rate_radps_ = 0, pitch_rad_ = 0, pitch_rate_radps_ = 0;

  double z_m_ = 0, side_mps_ = 0, up_mps_ = 0, ahead_mps_ = 0;  // the body's jitter

  bool parked_ = true;
  double wanted_acceleration_mps2_ = 0, wanted_yaw_rate_radps_ = 0;

  Chance driver_chance_, ground_chance_, slip_chance_, jitter_chance_;
  GaussMarkov wander_, ground_roll_, ground_pitch_, slip_left_, slip_right_, side_jitter_, up_jitter_, ahead_jitter_;
  int tick_ = 0;  // of kStep, within the driver's 10 ms
};

}  // namespace tetap::sim
