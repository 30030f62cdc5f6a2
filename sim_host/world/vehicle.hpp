// SPDX-License-Identifier: Apache-2.0
// The vehicle's true path: a B-spline through what its driver or pilot does. Position, velocity, acceleration, attitude
// and turn rates are closed forms of each other (Furgale, Barfoot, Sibley, "Continuous-time batch estimation using
// temporal basis functions", ICRA 2012). Wheels roll by the geometry of that path.
#pragma once

#include "sim_host/world/chassis.hpp"
#include "sim_host/world/multicopter.hpp"
#include "sim_host/world/spline.hpp"

#include <array>
#include <variant>

namespace tetap::sim {

class Vehicle {
 public:
  static constexpr base::Micros kStep{500};  ///< random processes and sensors live on this grid
  static constexpr base::Micros kInterval{10'000};

  /// `substeps` integration steps of the driver's model per kStep.
  Vehicle(const VehicleParameters& parameters, const Plan& plan, std::uint64_t seed, int substeps);

  /// Advances by kStep.
  Motion step();
  /// Set down elsewhere, with the motion that it has: where the plan is, now that it has jumped ahead.
  void place(const PathPoint& at);
  /// Span by which the plan is driven ahead of time (kidnapping along the course).
  void set_ahead(base::Micros ahead) { ahead_ = ahead; }
  [[nodiscard]] base::Micros ahead() const { return ahead_; }
  [[nodiscard]] Truth truth() const;

 private:
  struct State {
    Vector3 position_m, velocity_mps, acceleration_mps2, attitude_rad, attitude_rate_radps;
  };
  [[nodiscard]] State at(double u) const;
  [[nodiscard]] static Vector3 body_rate(const State& now);
  void extend();
  void shake(double yaw_rad);
  void roll_wheels(const State& now, Motion& motion) const;

  VehicleParameters parameters_;
  std::variant<Chassis, Multicopter> driver_;
  base::Micros ahead_;
  base::Micros driven_;  ///< time that the driver has reached: three intervals before the path
  double track_m_;

  std::array<QuinticSpline, 6> path_;  ///< x, y, z, roll, pitch, yaw
  int tick_ = 0;                       ///< steps of kStep within the interval
  bool airborne_ = false;

  Vector3 jitter_m_{}, jitter_mps_{}, jitter_mps2_{};  ///< trembling of the body, in n

  Chance slip_chance_, jitter_chance_;
  GaussMarkov slip_left_, slip_right_, slip_yaw_, side_jitter_, up_jitter_, ahead_jitter_;
};

}  // namespace tetap::sim
