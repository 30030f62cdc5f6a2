// SPDX-License-Identifier: Apache-2.0
#include "sim_host/world/multicopter.hpp"

namespace tetap::sim {
namespace {

// All [own]: a quadrotor of some 1.5 kg.
constexpr double kPilot_s = 0.010;
constexpr int kMulticopterSteps = 5;  // of 2 ms
constexpr double kHeight_m = 10, kClimb_mps = 1.5, kSink_mps = 1.0, kHover_s = 4;
constexpr double kSwell_m = 4, kSwell_per_m = 2 * kPi / 90;  // climbs and descents along the way
constexpr double kAlong = 1.2, kSpeed = 2.0;                 // pilot: 1/s^2, 1/s
constexpr double kMost_mps2 = 4.0, kMostClimb_mps2 = 3.0, kMostTurn_radps = 1.0;
constexpr double kAttitude_radps = 10, kMulticopterDamping = 0.8;
constexpr double kDrag_per_s = 0.15;
constexpr double kGust_mps2 = 0.3, kGust_s = 2.0;
constexpr double kShake_rad = 0.01, kShake_s = 0.3;
constexpr double kTurn = 1.5, kYawLag_s = 0.15;

}  // namespace

Multicopter::Multicopter(const VehicleParameters& parameters, const Plan& plan, std::uint64_t seed, int substeps)
    : parameters_{parameters},
      plan_{&plan},
      substeps_{substeps},
      pilot_chance_{seed, Stream::kDriver},
      air_chance_{seed, Stream::kGround},
      wander_x_{parameters.driver_wander_m, parameters.driver_wander_tau_s, kPilot_s, pilot_chance_},
      wander_y_{parameters.driver_wander_m, parameters.driver_wander_tau_s, kPilot_s, pilot_chance_},
      gust_x_{kGust_mps2, kGust_s, kPilot_s, air_chance_},
      gust_y_{kGust_mps2, kGust_s, kPilot_s, air_chance_},
      gust_z_{0.5 * kGust_mps2, kGust_s, kPilot_s, air_chance_},
      shake_roll_{kShake_rad, kShake_s, kPilot_s, air_chance_},
      shake_pitch_{kShake_rad, kShake_s, kPilot_s, air_chance_} {
  Chance start{seed, Stream::kStart};
  const PathPoint at = plan.path(0);
  position_m_[0] = at.x_m + start.normal(parameters.start_m);
  position_m_[1] = at.y_m + start.normal(parameters.start_m);
  yaw_rad_ = at.yaw_rad + start.normal(parameters.start_rad);
}

Pose Multicopter::pose() const {
  return {.position_n_m = position_m_, .attitude_rad = {roll_rad_, pitch_rad_, yaw_rad_}};
}

void Multicopter::move(const PlanarMove& by) {
  by.apply(position_m_[0], position_m_[1]);
  PlanarMove turn{.turn_rad = by.turn_rad};
  turn.apply(velocity_mps_[0], velocity_mps_[1]);
  yaw_rad_ += by.turn_rad;
}

Multicopter::Height Multicopter::height(base::Micros at) const {
  const double time_s = static_cast<double>(at.us) * 1e-6;
  const double up_s = plan_->departure_s() - kHover_s - kHeight_m / kClimb_mps;
  const double down_s = plan_->arrival_s() + kHover_s;
  if (time_s < up_s) return {};
  const PlanPoint way = plan_->at(at);
  const Direction swell = direction(kSwell_per_m * way.s_m);
  const double cruise_m = kHeight_m + kSwell_m * swell.sin;
  if (time_s > down_s) {
    const double left_m = cruise_m - kSink_mps * (time_s - down_s);
    return left_m > 0 ? Height{left_m, -kSink_mps} : Height{};
  }
  const double climbed_m = kClimb_mps * (time_s - up_s);
  if (climbed_m < kHeight_m) return {climbed_m, kClimb_mps};
  return {cruise_m, kSwell_m * kSwell_per_m * swell.cos * way.speed_mps};
}

void Multicopter::advance(base::Micros wanted) {
  decide(wanted);
  const double h_s = kPilot_s / (kMulticopterSteps * substeps_);
  for (int k = 0; k < kMulticopterSteps * substeps_; ++k) integrate(h_s);
}

void Multicopter::decide(base::Micros at) {
  for (GaussMarkov* one : {&gust_x_, &gust_y_, &gust_z_, &shake_roll_, &shake_pitch_}) one->next(air_chance_);
  const double off_x_m = wander_x_.next(pilot_chance_), off_y_m = wander_y_.next(pilot_chance_);
  const Height goal = height(at);
  landing_ = airborne_ && goal.z_m <= 0;
  if (goal.z_m > 0) airborne_ = true;
  if (landing_ && position_m_[2] < 0.005) airborne_ = false;
  if (!airborne_) {
    velocity_mps_ = {};
    position_m_[2] = 0;
    roll_goal_rad_ = pitch_goal_rad_ = yaw_rate_goal_radps_ = yaw_rate_radps_ = climb_mps2_ = 0;
    return;
  }
  const PlanPoint wanted = plan_->at(at);
  const PathPoint here = plan_->path(wanted.s_m);
  const Direction way = direction(here.yaw_rad);
  const double bend_mps2 = wanted.speed_mps * wanted.speed_mps * here.curvature_per_m;
  const auto asked = [](double ahead, double speed, double way_m) { return ahead + kSpeed * speed + kAlong * way_m; };
  const double ax = asked(wanted.acceleration_mps2 * way.cos - bend_mps2 * way.sin,
                          wanted.speed_mps * way.cos - velocity_mps_[0], here.x_m + off_x_m - position_m_[0]);
  const double ay = asked(wanted.acceleration_mps2 * way.sin + bend_mps2 * way.cos,
                          wanted.speed_mps * way.sin - velocity_mps_[1], here.y_m + off_y_m - position_m_[1]);
  climb_mps2_ =
      clamp(asked(0, goal.rate_mps - velocity_mps_[2], goal.z_m - position_m_[2]), -kMostClimb_mps2, kMostClimb_mps2);
  const Direction d = direction(yaw_rad_);
  const double ahead = clamp(d.cos * ax + d.sin * ay, -kMost_mps2, kMost_mps2);
  const double left = clamp(d.cos * ay - d.sin * ax, -kMost_mps2, kMost_mps2);
  const double lift = kG0 + climb_mps2_;
  pitch_goal_rad_ = sim::atan2(ahead, lift) + shake_pitch_.value();
  roll_goal_rad_ = -sim::atan2(left, lift) + shake_roll_.value();
  yaw_rate_goal_radps_ = clamp(wanted.speed_mps * here.curvature_per_m + kTurn * (here.yaw_rad - yaw_rad_),
                               -kMostTurn_radps, kMostTurn_radps);
}

void Multicopter::integrate(double h_s) {
  const auto spring = [h_s](double goal, double& angle, double& angle_rate) {
    angle_rate += h_s * kAttitude_radps * (kAttitude_radps * (goal - angle) - 2 * kMulticopterDamping * angle_rate);
    angle += h_s * angle_rate;
  };
  spring(roll_goal_rad_, roll_rad_, roll_rate_radps_);
  spring(pitch_goal_rad_, pitch_rad_, pitch_rate_radps_);
  if (!airborne_) return;
  yaw_rate_radps_ += h_s / kYawLag_s * (yaw_rate_goal_radps_ - yaw_rate_radps_);
  yaw_rad_ += h_s * yaw_rate_radps_;
  const Direction r = direction(roll_rad_), p = direction(pitch_rad_), d = direction(yaw_rad_);
  const double lift = kG0 + climb_mps2_;
  const double ahead = lift * p.sin / p.cos, left = -lift * r.sin / r.cos;
  const Vector3 acceleration{d.cos * ahead - d.sin * left - kDrag_per_s * velocity_mps_[0] + gust_x_.value(),
                             d.sin * ahead + d.cos * left - kDrag_per_s * velocity_mps_[1] + gust_y_.value(),
                             climb_mps2_ + gust_z_.value()};
  for (std::size_t i = 0; i < 3; ++i) {
    velocity_mps_[i] += h_s * acceleration[i];
    position_m_[i] += h_s * velocity_mps_[i];
  }
  if (position_m_[2] < 0) position_m_[2] = velocity_mps_[2] = 0;
}

}  // namespace tetap::sim
