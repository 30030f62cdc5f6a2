// SPDX-License-Identifier: Apache-2.0
#include "sim_host/world/vehicle.hpp"

namespace tetap::sim {
namespace {

constexpr double kVehicleStep_s = 500e-6;
constexpr int kTicks = 20;
constexpr double kInterval_s = kTicks * kVehicleStep_s;

std::variant<Chassis, Multicopter> driver_of(const VehicleParameters& parameters, const Plan& plan, std::uint64_t seed,
                                             int substeps) {
  if (parameters.kind == VehicleKind::kMulticopter) return Multicopter{parameters, plan, seed, substeps};
  return Chassis{parameters, plan, seed, substeps};
}

std::array<QuinticSpline, 6> standing_at(const Pose& start) {
  const auto one = [](double x) { return QuinticSpline{x, kInterval_s}; };
  const auto& [p, a] = start;
  return {one(p[0]), one(p[1]), one(p[2]), one(a[0]), one(a[1]), one(a[2])};
}

Pose pose_of(const std::variant<Chassis, Multicopter>& driver) {
  return std::visit([](const auto& one) { return one.pose(); }, driver);
}

}  // namespace

Vehicle::Vehicle(const VehicleParameters& parameters, const Plan& plan, std::uint64_t seed, int substeps)
    : parameters_{parameters},
      driver_{driver_of(parameters, plan, seed, substeps)},
      track_m_{parameters.track_m * (1 + parameters.track_error)},
      path_{standing_at(pose_of(driver_))},
      slip_chance_{seed, Stream::kSlip},
      jitter_chance_{seed, Stream::kJitter},
      slip_left_{parameters.slip_random, parameters.slip_random_tau_s, kInterval_s, slip_chance_},
      slip_right_{parameters.slip_random, parameters.slip_random_tau_s, kInterval_s, slip_chance_},
      slip_yaw_{parameters.slip_yaw, parameters.slip_random_tau_s, kInterval_s, slip_chance_},
      side_jitter_{parameters.jitter_mps, parameters.jitter_tau_s, kVehicleStep_s, jitter_chance_},
      up_jitter_{parameters.jitter_mps, parameters.jitter_tau_s, kVehicleStep_s, jitter_chance_},
      ahead_jitter_{parameters.jitter_ahead_mps, parameters.jitter_tau_s, kVehicleStep_s, jitter_chance_} {
  for (int k = 0; k < 3; ++k) extend();
}

/// The next control point of the path. An interval lies between the third and the fourth of its six.
void Vehicle::extend() {
  std::visit([&](auto& one) { one.advance(driven_ + ahead_); }, driver_);
  driven_ += kInterval;
  const Pose pose = pose_of(driver_);
  for (std::size_t i = 0; i < 3; ++i) {
    path_[i].push(pose.position_n_m[i]);
    path_[3 + i].push(pose.attitude_rad[i]);
  }
  if (const auto* flies = std::get_if<Multicopter>(&driver_)) airborne_ = flies->airborne();
}

Vehicle::State Vehicle::at(double u) const {
  State now;
  for (std::size_t i = 0; i < 3; ++i) {
    const QuinticSpline::Value p = path_[i].at(u), a = path_[3 + i].at(u);
    now.position_m[i] = p.x, now.velocity_mps[i] = p.rate, now.acceleration_mps2[i] = p.acceleration;
    now.attitude_rad[i] = a.x, now.attitude_rate_radps[i] = a.rate;
  }
  return now;
}

/// Diebel, "Representing attitude", 2006, eq. 77, of roll, pitch, yaw turned in the order z-y-x.
Vector3 Vehicle::body_rate(const State& now) {
  const Direction r = direction(now.attitude_rad[0]), p = direction(now.attitude_rad[1]);
  const Vector3& angle_rate = now.attitude_rate_radps;
  return {angle_rate[0] - angle_rate[2] * p.sin, angle_rate[1] * r.cos + angle_rate[2] * p.cos * r.sin,
          angle_rate[2] * p.cos * r.cos - angle_rate[1] * r.sin};
}

void Vehicle::place(const PathPoint& to) {
  const State now = at(static_cast<double>(tick_) / kTicks);
  const PlanarMove by{.from_x_m = now.position_m[0],
                      .from_y_m = now.position_m[1],
                      .to_x_m = to.x_m,
                      .to_y_m = to.y_m,
                      .turn_rad = to.yaw_rad - now.attitude_rad[2]};
  std::array<double, 6> x{}, y{};
  for (std::size_t i = 0; i < 6; ++i) {
    x[i] = path_[0].control(i), y[i] = path_[1].control(i);
    by.apply(x[i], y[i]);
  }
  path_[0].move([&](double, std::size_t i) { return x[i]; });
  path_[1].move([&](double, std::size_t i) { return y[i]; });
  path_[5].move([&](double yaw_rad, std::size_t) { return yaw_rad + by.turn_rad; });
  std::visit([&](auto& one) { one.move(by); }, driver_);
}

/// A velocity that is linear over each step, on top of the path's.
void Vehicle::shake(double yaw_rad) {
  if (parameters_.jitter_mps <= 0) return;
  const double side = side_jitter_.next(jitter_chance_);
  const double up = up_jitter_.next(jitter_chance_);
  const double ahead = ahead_jitter_.next(jitter_chance_);
  const Direction d = direction(yaw_rad);
  const Vector3 next{ahead * d.cos - side * d.sin, ahead * d.sin + side * d.cos, up};
  jitter_mps2_ = (1 / kVehicleStep_s) * (next - jitter_mps_);
  jitter_m_ = jitter_m_ + 0.5 * kVehicleStep_s * (jitter_mps_ + next);
  jitter_mps_ = next;
}

Motion Vehicle::step() {
  if (tick_ == kTicks) {
    tick_ = 0;
    extend();
    slip_left_.next(slip_chance_);
    slip_right_.next(slip_chance_);
    slip_yaw_.next(slip_chance_);
  }
  const State now = at((tick_ + 0.5) / kTicks);
  ++tick_;
  shake(now.attitude_rad[2]);

  Motion motion;
  motion.rate_b_radps = body_rate(now);
  motion.acceleration_n_mps2 = now.acceleration_mps2 + jitter_mps2_;
  motion.attitude_rad = now.attitude_rad;
  motion.position_n_m = now.position_m;
  motion.velocity_n_mps = now.velocity_mps;
  if (parameters_.kind == VehicleKind::kMulticopter)
    motion.shaking_mps = airborne_ ? parameters_.rotor_mps : 0;
  else
    roll_wheels(now, motion);
  return motion;
}

/// Travel of the contact points, with slip on top that grows with the load and is not there at standstill.
void Vehicle::roll_wheels(const State& now, Motion& motion) const {
  const Direction d = direction(now.attitude_rad[2]);
  const double speed = d.cos * now.velocity_mps[0] + d.sin * now.velocity_mps[1];
  const double rate = now.attitude_rate_radps[2];
  const double lateral = d.cos * now.acceleration_mps2[1] - d.sin * now.acceleration_mps2[0];
  // The speed's own change: acceleration along the body, less the share of a sideways velocity that turns.
  const double drift = d.cos * now.velocity_mps[1] - d.sin * now.velocity_mps[0];
  const double acceleration = d.cos * now.acceleration_mps2[0] + d.sin * now.acceleration_mps2[1] + rate * drift;
  const double load = clamp(0.3 + magnitude(acceleration) + magnitude(lateral), 0, 2);
  const double slip = parameters_.slip_per_mps2 * acceleration * (speed < 0 ? -1 : 1) +
                      parameters_.slip_curve_per_mps2 * magnitude(lateral);
  const double turn = 0.5 * track_m_ * rate * (1 + slip_yaw_.value());
  motion.rim_left_m = kVehicleStep_s * (speed - turn) * (1 + slip + load * slip_left_.value());
  motion.rim_right_m = kVehicleStep_s * (speed + turn) * (1 + slip + load * slip_right_.value());
  motion.shaking_mps = speed;
}

Truth Vehicle::truth() const {
  const State now = at(static_cast<double>(tick_) / kTicks);
  const Direction d = direction(now.attitude_rad[2]);
  const Vector3 v = now.velocity_mps + jitter_mps_;
  const Vector3 p = now.position_m + jitter_m_;
  return {.time = {},
          .x_m = p[0],
          .y_m = p[1],
          .z_m = p[2],
          .roll_rad = now.attitude_rad[0],
          .pitch_rad = now.attitude_rad[1],
          .yaw_rad = wrap(now.attitude_rad[2]),
          .speed_mps = d.cos * v[0] + d.sin * v[1],
          .yaw_rate_radps = now.attitude_rate_radps[2],
          .rate_b_radps = body_rate(now),
          .v_n_mps = v};
}

}  // namespace tetap::sim
