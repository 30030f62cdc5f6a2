// SPDX-License-Identifier: Apache-2.0
// A vehicle on wheels: a driver who follows the plan, first-order lags of speed and turn, a body that leans on its
// tyres. Driver: Kanayama et al., "A stable tracking control method for an autonomous mobile robot", ICRA 1990, eq. 5.
#pragma once

#include "sim_host/world/chance.hpp"
#include "sim_host/world/course.hpp"
#include "sim_host/world/motion.hpp"
#include "sim_host/world/numbers.hpp"

namespace tetap::sim {

class Chassis {
 public:
  /// `substeps` integration steps per 0.5 ms.
  Chassis(const VehicleParameters& parameters, const Plan& plan, std::uint64_t seed, int substeps);

  [[nodiscard]] Pose pose() const;
  /// Drives for one interval of the path; `wanted` is the time of the plan at its begin.
  void advance(base::Micros wanted);
  void move(const PlanarMove& by);

 private:
  void decide(base::Micros wanted);
  void integrate(double h_s);

  VehicleParameters parameters_;
  const Plan* plan_;
  int substeps_;

  double x_m_, y_m_, yaw_rad_;  // of the middle of the axle that does not steer; yaw is continuous
  double speed_mps_ = 0, acceleration_mps2_ = 0, yaw_rate_radps_ = 0;
  double roll_rad_ = 0, roll_rate_radps_ = 0, pitch_rad_ = 0, pitch_rate_radps_ = 0;
  bool parked_ = true;
  double wanted_acceleration_mps2_ = 0, wanted_yaw_rate_radps_ = 0;

  Chance driver_chance_, ground_chance_;
  GaussMarkov wander_, ground_roll_, ground_pitch_;
};

}  // namespace tetap::sim
