// SPDX-License-Identifier: Apache-2.0
#include "sim_host/world/chassis.hpp"

namespace tetap::sim {
namespace {

constexpr double kStep_s = 500e-6;
constexpr int kSteps = 20;  // the driver decides every 10 ms
constexpr double kDriver_s = kSteps * kStep_s;
constexpr double kBrakeLag_s = 0.05;
constexpr double kAccelerationMax_mps2 = 3.0;
constexpr double kSuspension_radps = 2 * kPi * 2.0;  // body on its tyres: 2 Hz, well damped
constexpr double kDamping = 0.5;

}  // namespace

Chassis::Chassis(const VehicleParameters& parameters, const Plan& plan, std::uint64_t seed, int substeps)
    : parameters_{parameters},
      plan_{&plan},
      substeps_{substeps},
      driver_chance_{seed, Stream::kDriver},
      ground_chance_{seed, Stream::kGround},
      wander_{parameters.driver_wander_m, parameters.driver_wander_tau_s, kDriver_s, driver_chance_},
      ground_roll_{parameters.ground_rad, parameters.ground_tau_s, kDriver_s, ground_chance_},
      ground_pitch_{parameters.ground_rad, parameters.ground_tau_s, kDriver_s, ground_chance_} {
  Chance start{seed, Stream::kStart};
  const PathPoint at = plan.path(0);
  x_m_ = at.x_m + start.normal(parameters.start_m);
  y_m_ = at.y_m + start.normal(parameters.start_m);
  yaw_rad_ = at.yaw_rad + start.normal(parameters.start_rad);
  // The plan leads the body's origin at rest; its axle stands ahead of it.
  const Direction d = direction(yaw_rad_);
  x_m_ += parameters.axle_x_b_m * d.cos;
  y_m_ += parameters.axle_x_b_m * d.sin;
}

Pose Chassis::pose() const {
  const Direction d = direction(yaw_rad_);
  return {.position_n_m = {x_m_ - parameters_.axle_x_b_m * d.cos, y_m_ - parameters_.axle_x_b_m * d.sin, 0},
          .attitude_rad = {roll_rad_, pitch_rad_, yaw_rad_}};
}

void Chassis::move(const PlanarMove& by) {
  by.apply(x_m_, y_m_);
  yaw_rad_ += by.turn_rad;
}

void Chassis::advance(base::Micros wanted) {
  decide(wanted);
  ground_roll_.next(ground_chance_);
  ground_pitch_.next(ground_chance_);
  const double h_s = kStep_s / substeps_;
  for (int k = 0; k < kSteps * substeps_; ++k) integrate(h_s);
}

void Chassis::decide(base::Micros at) {
  const VehicleParameters& n = parameters_;
  const PlanPoint wanted = plan_->at(at);
  parked_ = wanted.parked;
  // The driver accelerates and turns in early by the lags, and wanders off the line as people do.
  const PlanPoint soon = plan_->at(at + base::Micros{static_cast<std::int64_t>(n.acceleration_lag_s * 1e6)});
  const PathPoint here = plan_->path(wanted.s_m);
  const double curvature = plan_->path(wanted.s_m + wanted.speed_mps * n.yaw_lag_s).curvature_per_m;
  const Direction d = direction(yaw_rad_);
  const double dx = here.x_m - x_m_ + n.axle_x_b_m * d.cos;
  const double dy = here.y_m - y_m_ + n.axle_x_b_m * d.sin;
  const double along_m = d.cos * dx + d.sin * dy;
  const double beside_m = d.cos * dy - d.sin * dx + wander_.next(driver_chance_);
  const Direction off = direction(here.yaw_rad - yaw_rad_);

  constexpr double kAlong = 1.0, kSpeed = 2.5;
  const double speed = wanted.speed_mps * off.cos + kAlong * along_m;
  wanted_acceleration_mps2_ =
      clamp(soon.acceleration_mps2 + kSpeed * (speed - speed_mps_), -kAccelerationMax_mps2, kAccelerationMax_mps2);
  wanted_yaw_rate_radps_ =
      wanted.speed_mps * (curvature + n.steer_beside_per_m2 * clamp(beside_m, -n.steer_most_m, n.steer_most_m) +
                          n.steer_heading_per_m * off.sin);
}

void Chassis::integrate(double h_s) {
  // Speeds: first-order lags; brakes hold the vehicle exactly still.
  const VehicleParameters& n = parameters_;
  const double speed_before = speed_mps_;
  const double rate_before = yaw_rate_radps_;
  if (parked_ && magnitude(speed_mps_) < 0.05) {
    acceleration_mps2_ = -speed_mps_ / kBrakeLag_s;
    speed_mps_ += h_s * acceleration_mps2_;
    yaw_rate_radps_ -= h_s / kBrakeLag_s * yaw_rate_radps_;
    if (magnitude(speed_mps_) < 1e-4 && magnitude(yaw_rate_radps_) < 1e-4)
      speed_mps_ = yaw_rate_radps_ = acceleration_mps2_ = 0;
  } else {
    const double lagging = acceleration_mps2_;
    acceleration_mps2_ += h_s / n.acceleration_lag_s * (wanted_acceleration_mps2_ - acceleration_mps2_);
    speed_mps_ += 0.5 * h_s * (lagging + acceleration_mps2_);
    yaw_rate_radps_ += h_s / n.yaw_lag_s * (wanted_yaw_rate_radps_ - yaw_rate_radps_);
  }
  if (n.turning_radius_m > 0) {  // wheels that steer turn no sharper than their lock, and not on the spot
    const double most_radps = magnitude(speed_mps_) / n.turning_radius_m;
    yaw_rate_radps_ = clamp(yaw_rate_radps_, -most_radps, most_radps);
  }
  const double speed = 0.5 * (speed_before + speed_mps_);
  const double rate = 0.5 * (rate_before + yaw_rate_radps_);

  // Pose: the velocity of the step's middle, turned by the yaw of the middle.
  const Direction d = direction(yaw_rad_ + 0.5 * h_s * rate);
  const double drift = -n.side_slip_s * speed * rate;
  x_m_ += h_s * (speed * d.cos - drift * d.sin);
  y_m_ += h_s * (speed * d.sin + drift * d.cos);
  yaw_rad_ += h_s * rate;

  // Lean: a damped spring towards what load and ground ask for. Outside of a left curve is right: roll > 0 is left side
  // up.
  const double lateral = speed * rate;
  const double uneven = clamp(magnitude(speed) / 0.5, 0, 1);
  const double roll_goal = n.roll_rad_per_mps2 * lateral + uneven * ground_roll_.value();
  const double pitch_goal = -n.pitch_rad_per_mps2 * acceleration_mps2_ + uneven * ground_pitch_.value();
  const auto spring = [h_s](double goal, double& angle, double& angle_rate) {
    const double before = angle_rate;
    angle_rate += h_s * kSuspension_radps * (kSuspension_radps * (goal - angle) - 2 * kDamping * angle_rate);
    angle += 0.5 * h_s * (before + angle_rate);
  };
  spring(roll_goal, roll_rad_, roll_rate_radps_);
  spring(pitch_goal, pitch_rad_, pitch_rate_radps_);
}

}  // namespace tetap::sim
