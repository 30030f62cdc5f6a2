// SPDX-License-Identifier: Apache-2.0
#include "sim_host/world/rover.hpp"

namespace tetap::sim {
namespace {

constexpr double kStep_s = 500e-6;
constexpr int kDriverTicks = 20;  // the driver decides every 10 ms
constexpr double kDriver_s = 0.010;
constexpr double kAccelerationLag_s = 0.10;  // motor current and load
constexpr double kYawLag_s = 0.12;
constexpr double kBrakeLag_s = 0.05;
constexpr double kAccelerationMax_mps2 = 3.0;
constexpr double kSuspension_radps = 2 * kPi * 2.0;  // body on its tyres: 2 Hz, well damped
constexpr double kDamping = 0.5;

}  // namespace

Vector3 to_level(const Vector3& attitude_rad, const Vector3& v) {
  const Direction r = direction(attitude_rad[0]);
  const Direction p = direction(attitude_rad[1]);
  const Direction w = direction(attitude_rad[2]);
  const Vector3 a{v[0], r.cos * v[1] - r.sin * v[2], r.sin * v[1] + r.cos * v[2]};
  const Vector3 b{p.cos * a[0] + p.sin * a[2], a[1], p.cos * a[2] - p.sin * a[0]};
  return {w.cos * b[0] - w.sin * b[1], w.sin * b[0] + w.cos * b[1], b[2]};
}

Vector3 to_body(const Vector3& attitude_rad, const Vector3& v) {
  const Direction r = direction(attitude_rad[0]);
  const Direction p = direction(attitude_rad[1]);
  const Direction w = direction(attitude_rad[2]);
  const Vector3 b{w.cos * v[0] + w.sin * v[1], w.cos * v[1] - w.sin * v[0], v[2]};
  const Vector3 a{p.cos * b[0] - p.sin * b[2], b[1], p.sin * b[0] + p.cos * b[2]};
  return {a[0], r.cos * a[1] + r.sin * a[2], r.cos * a[2] - r.sin * a[1]};
}

Rover::Rover(const RoverNumbers& parameters, const Plan& plan, std::uint64_t seed, int substeps)
    : parameters_{parameters},
      plan_{&plan},
      substeps_{substeps},
      track_m_{parameters.track_m * (1 + parameters.track_error)},
      driver_chance_{seed, Stream::kDriver},
      ground_chance_{seed, Stream::kGround},
      slip_chance_{seed, Stream::kSlip},
      jitter_chance_{seed, Stream::kJitter},
      wander_{parameters.driver_wander_m, parameters.driver_wander_tau_s, kDriver_s, driver_chance_},
      ground_roll_{parameters.ground_rad, parameters.ground_tau_s, kDriver_s, ground_chance_},
      ground_pitch_{parameters.ground_rad, parameters.ground_tau_s, kDriver_s, ground_chance_},
      slip_left_{parameters.slip_random, parameters.slip_random_tau_s, kDriver_s, slip_chance_},
      slip_right_{parameters.slip_random, parameters.slip_random_tau_s, kDriver_s, slip_chance_},
      side_jitter_{parameters.jitter_mps, parameters.jitter_tau_s, kStep_s, jitter_chance_},
      up_jitter_{parameters.jitter_mps, parameters.jitter_tau_s, kStep_s, jitter_chance_},
      ahead_jitter_{parameters.jitter_ahead_mps, parameters.jitter_tau_s, kStep_s, jitter_chance_} {
  Chance start{seed, Stream::kStart};
  const PathPoint at = plan.path(0);
  x_m_ = at.x_m + start.normal(parameters.start_m);
  y_m_ = at.y_m + start.normal(parameters.start_m);
  yaw_rad_ = at.yaw_rad + start.normal(parameters.start_rad);
}

void Rover::place(const PathPoint& at) { x_m_ = at.x_m, y_m_ = at.y_m, yaw_rad_ = at.yaw_rad; }

void Rover::drive(base::Micros since_start) {
  const PlanPoint wanted = plan_->at(since_start + ahead_);
  parked_ = wanted.parked;
  // The driver accelerates and turns in early by the lags, and wanders off the line as people do.
  const PlanPoint soon =
      plan_->at(since_start + ahead_ + base::Micros{static_cast<std::int64_t>(kAccelerationLag_s * 1e6)});
  const PathPoint here = plan_->path(wanted.s_m);
  const double curvature = plan_->path(wanted.s_m + wanted.speed_mps * kYawLag_s).curvature_per_m;
  const Direction d = direction(yaw_rad_);
  const double dx = here.x_m - x_m_;
  const double dy = here.y_m - y_m_;
  const double along_m = d.cos * dx + d.sin * dy;
  const double beside_m = d.cos * dy - d.sin * dx + wander_.next(driver_chance_);
  const Direction off = direction(here.yaw_rad - yaw_rad_);

  constexpr double kAlong = 1.0, kBeside = 1.5, kHeading = 2.5, kSpeed = 2.5;
  const double speed = wanted.speed_mps * off.cos + kAlong * along_m;
  wanted_acceleration_mps2_ =
      clamp(soon.acceleration_mps2 + kSpeed * (speed - speed_mps_), -kAccelerationMax_mps2, kAccelerationMax_mps2);
  wanted_yaw_rate_radps_ = wanted.speed_mps * (curvature + kBeside * clamp(beside_m, -0.5, 0.5) + kHeading * off.sin);
}

void Rover::shake() {
  ground_roll_.next(ground_chance_);
  ground_pitch_.next(ground_chance_);
  slip_left_.next(slip_chance_);
  slip_right_.next(slip_chance_);
}

void Rover::jitter() {
  if (parameters_.jitter_mps <= 0) return;
  const double side = side_jitter_.next(jitter_chance_);
  const double up = up_jitter_.next(jitter_chance_);
  const double ahead = ahead_jitter_.next(jitter_chance_);
  const Direction d = direction(yaw_rad_);
  x_m_ += 0.5 * kStep_s * ((ahead_mps_ + ahead) * d.cos - (side_mps_ + side) * d.sin);
  y_m_ += 0.5 * kStep_s * ((ahead_mps_ + ahead) * d.sin + (side_mps_ + side) * d.cos);
  z_m_ += 0.5 * kStep_s * (up_mps_ + up);
  side_mps_ = side;
  up_mps_ = up;
  ahead_mps_ = ahead;
}

Motion Rover::step(base::Micros since_start) {
  if (tick_ == 0) {
    drive(since_start);
    shake();
  }
  tick_ = (tick_ + 1) % kDriverTicks;

  Motion motion;
  const Truth before = truth();
  const double h_s = 500e-6 / substeps_;
  for (int k = 0; k < substeps_; ++k) integrate(h_s, motion);
  jitter();
  const Truth after = truth();
  for (std::size_t i = 0; i < 3; ++i) {
    motion.acceleration_n_mps2[i] = (after.v_n_mps[i] - before.v_n_mps[i]) / 500e-6;
    motion.rate_b_radps[i] /= substeps_;
  }
  const double half_turn = 0.5 * yaw_rate_radps_ * 500e-6;
  motion.attitude_rad = {0.5 * (before.roll_rad + after.roll_rad), 0.5 * (before.pitch_rad + after.pitch_rad),
                         yaw_rad_ - half_turn};
  return motion;
}

void Rover::integrate(double h_s, Motion& motion) {
  // Speeds: first-order lags; brakes hold the rover exactly still.
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
    acceleration_mps2_ += h_s / kAccelerationLag_s * (wanted_acceleration_mps2_ - acceleration_mps2_);
    speed_mps_ += 0.5 * h_s * (lagging + acceleration_mps2_);
    yaw_rate_radps_ += h_s / kYawLag_s * (wanted_yaw_rate_radps_ - yaw_rate_radps_);
  }
  const double speed = 0.5 * (speed_before + speed_mps_);
  const double rate = 0.5 * (rate_before + yaw_rate_radps_);

  // Pose: the velocity of the step's middle, turned by the yaw of the middle.
  const Direction d = direction(yaw_rad_ + 0.5 * h_s * rate);
  const double drift = -parameters_.side_slip_s * speed * rate;
  x_m_ += h_s * (speed * d.cos - drift * d.sin);
  y_m_ += h_s * (speed * d.sin + drift * d.cos);
  yaw_rad_ += h_s * rate;

  // Lean: a damped spring towards what load and ground ask for. Outside of a left curve is right: roll > 0 is left side
  // up.
  const double lateral = speed * rate;
  const double uneven = clamp(magnitude(speed) / 0.5, 0, 1);
  const double roll_goal = parameters_.roll_rad_per_mps2 * lateral + uneven * ground_roll_.value();
  const double pitch_goal = -parameters_.pitch_rad_per_mps2 * acceleration_mps2_ + uneven * ground_pitch_.value();
  const auto spring = [h_s](double goal, double& angle, double& angle_rate) {
    const double before = angle_rate;
    angle_rate += h_s * kSuspension_radps * (kSuspension_radps * (goal - angle) - 2 * kDamping * angle_rate);
    angle += 0.5 * h_s * (before + angle_rate);
  };
  spring(roll_goal, roll_rad_, roll_rate_radps_);
  spring(pitch_goal, pitch_rad_, pitch_rate_radps_);
  const Direction r = direction(roll_rad_);
  const Direction p = direction(pitch_rad_);
  motion.rate_b_radps[0] += roll_rate_radps_ - rate * p.sin;
  motion.rate_b_radps[1] += pitch_rate_radps_ * r.cos + rate * p.cos * r.sin;
  motion.rate_b_radps[2] += rate * p.cos * r.cos - pitch_rate_radps_ * r.sin;

  // Wheels: what the contact points travel, and slip on top, which grows with the load and is not there at standstill.
  const double load = clamp(0.3 + magnitude(acceleration_mps2_) + magnitude(lateral), 0, 2);
  const double slip = parameters_.slip_per_mps2 * acceleration_mps2_ * (speed < 0 ? -1 : 1) +
                      parameters_.slip_curve_per_mps2 * magnitude(lateral);
  motion.rim_left_m += h_s * (speed - 0.5 * track_m_ * rate) * (1 + slip + load * slip_left_.value());
  motion.rim_right_m += h_s * (speed + 0.5 * track_m_ * rate) * (1 + slip + load * slip_right_.value());
}

Truth Rover::truth() const {
  const Direction d = direction(yaw_rad_);
  const double speed = speed_mps_ + ahead_mps_;
  const double drift = side_mps_ - parameters_.side_slip_s * speed_mps_ * yaw_rate_radps_;
  return {.time = {},
          .x_m = x_m_,
          .y_m = y_m_,
          .z_m = z_m_,
          .roll_rad = roll_rad_,
          .pitch_rad = pitch_rad_,
          .yaw_rad = wrap(yaw_rad_),
          .speed_mps = speed,
          .yaw_rate_radps = yaw_rate_radps_,
          .v_n_mps = {speed * d.cos - drift * d.sin, speed * d.sin + drift * d.cos, up_mps_}};
}

}  // namespace tetap::sim
