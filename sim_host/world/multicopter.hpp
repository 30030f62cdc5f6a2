// SPDX-License-Identifier: Apache-2.0
// A multicopter. Its pilot takes off, flies the plan with climbs and descents, hovers where it stops, and lands. Thrust
// along the body's z axis makes every acceleration, so the body tilts for it. Source: Mellinger, Kumar, "Minimum snap
// trajectory generation and control for quadrotors", ICRA 2011, sec. III.
#pragma once

#include "sim_host/world/chance.hpp"
#include "sim_host/world/course.hpp"
#include "sim_host/world/motion.hpp"
#include "sim_host/world/numbers.hpp"

namespace tetap::sim {

class Multicopter {
 public:
  Multicopter(const VehicleParameters& parameters, const Plan& plan, std::uint64_t seed, int substeps);

  [[nodiscard]] Pose pose() const;
  /// Flies for one interval of the path; `wanted` is the time of the plan at its begin.
  void advance(base::Micros wanted);
  void move(const PlanarMove& by);
  [[nodiscard]] bool airborne() const { return airborne_; }

 private:
  struct Height {
    double z_m = 0, rate_mps = 0;
  };
  [[nodiscard]] Height height(base::Micros at) const;
  void decide(base::Micros wanted);
  void integrate(double h_s);

  VehicleParameters parameters_;
  const Plan* plan_;
  int substeps_;

  Vector3 position_m_{}, velocity_mps_{};
  double yaw_rad_ = 0, yaw_rate_radps_ = 0;
  double roll_rad_ = 0, roll_rate_radps_ = 0, pitch_rad_ = 0, pitch_rate_radps_ = 0;
  bool airborne_ = false, landing_ = false;
  double roll_goal_rad_ = 0, pitch_goal_rad_ = 0, yaw_rate_goal_radps_ = 0, climb_mps2_ = 0;

  Chance pilot_chance_, air_chance_;
  GaussMarkov wander_x_, wander_y_, gust_x_, gust_y_, gust_z_, shake_roll_, shake_pitch_;
};

}  // namespace tetap::sim
