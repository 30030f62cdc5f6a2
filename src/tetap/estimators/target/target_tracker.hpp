// SPDX-License-Identifier: Apache-2.0
// One moving target seen by a sensor at rest in the origin. A lidar gives positions (sightings of range and bearing), a
// radar detections (with the range rate). The kind of filter and its motion model are types: constant velocity by
// extended Kalman filter, constant turn rate and velocity by unscented filter.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/checks/persistence.hpp"
#include "tetap/estimators/context.hpp"
#include "tetap/estimators/estimate.hpp"
#include "tetap/filter/ekf.hpp"
#include "tetap/filter/ukf.hpp"
#include "tetap/filter/viewed.hpp"
#include "tetap/model/constant_velocity.hpp"
#include "tetap/model/ctrv.hpp"
#include "tetap/model/kinematics.hpp"
#include "tetap/sensor/samples.hpp"

#include <cstdint>
#include <type_traits>

namespace tetap::estimators {

/// Position and velocity of a target by its filter, and how fast the velocity turns.
struct TargetMotion {
  model::Kinematics<float> mean;
  filter::Matrix<float, 4, 4> covariance;
  float yaw_rate_radps = 0;

  /// Variance of the direction of the velocity, as far as that is linear, and its covariance with the rest.
  [[nodiscard]] float direction_variance(filter::Vector<float, 4>& across) const {
    const float speed2 = mean(2) * mean(2) + mean(3) * mean(3);
    const float per = 1.0F / (speed2 > 1e-6F ? speed2 : 1e-6F);
    const filter::Vector<float, 4> turn{0, 0, -mean(3) * per, mean(2) * per};
    across = covariance.lazyProduct(turn);
    return turn.dot(across);
  }
};

/// Constant velocity, state (x, vx, y, vy), extended Kalman filter; the acceleration is white noise per axis.
class VelocityTracking {
 public:
  static constexpr sensor::EstimatorKind kKind = sensor::EstimatorKind::kEkf;
  using State = filter::VectorState<float, 4>;

  void start(float x_m, float y_m, float sigma_m, const param::TargetParameters& n) {
    const float place = sigma_m * sigma_m, speed = n.sigma_speed_mps * n.sigma_speed_mps;
    filter_.x.value = {x_m, 0, y_m, 0};
    filter_.p = filter::Symmetric<float, 4>::diagonal({place, speed, place, speed});
  }
  void predict(float dt_s, const param::TargetParameters& n) {
    static_cast<void>(filter_.predict(model::ConstantVelocity<float>{
        .dt_s = dt_s, .acceleration_variance = n.acceleration_mps2 * n.acceleration_mps2}));
  }
  /// `model` makes the measurement's model for a type of state.
  template <class Model>
  [[nodiscard]] auto update(const Model& model, float gate, const param::TargetParameters&) {
    return filter_.update(model(std::type_identity<State>{}), gate);
  }
  [[nodiscard]] TargetMotion motion() const { return motion_of(filter_); }
  static constexpr auto members(auto& self) { return base::members(self.filter_); }

  template <class Filter>
  [[nodiscard]] static TargetMotion motion_of(const Filter& filter) {
    const auto j = model::kinematics_jacobian(filter.x);
    return {.mean = model::kinematics(filter.x),
            .covariance = j.lazyProduct(filter.p.dense()).lazyProduct(j.transpose())};
  }

 private:
  filter::Viewable<filter::Ekf<State>> filter_;
};

/// Constant turn rate and velocity, state (x, y, speed, yaw, yaw rate), unscented Kalman filter. A direction that
/// nobody knows is no yaw: until it is known to target.sigma_yaw_rad the target moves straight, by VelocityTracking.
class TurnTracking {
 public:
  static constexpr sensor::EstimatorKind kKind = sensor::EstimatorKind::kUkf;
  using State = model::CtrvState<float>;

  void start(float x_m, float y_m, float sigma_m, const param::TargetParameters& n) {
    straight_.start(x_m, y_m, sigma_m, n);
    filter_ = {};
    turns_ = false;
  }
  void predict(float dt_s, const param::TargetParameters& n) {
    if (!turns_) return straight_.predict(dt_s, n);
    static_cast<void>(filter_.predict(
        model::Ctrv<float>{.dt_s = dt_s,
                           .acceleration_variance = n.acceleration_mps2 * n.acceleration_mps2,
                           .yaw_acceleration_variance = n.yaw_acceleration_radps2 * n.yaw_acceleration_radps2}));
  }
  template <class Model>
  [[nodiscard]] auto update(const Model& model, float gate, const param::TargetParameters& n) {
    if (turns_) return filter_.update(model(std::type_identity<State>{}), gate);
    auto result = straight_.update(model, gate, n);
    if (result.verdict == filter::Verdict::kAccepted) begin_to_turn(n);
    return result;
  }
  [[nodiscard]] TargetMotion motion() const {
    if (!turns_) return straight_.motion();
    TargetMotion motion = VelocityTracking::motion_of(filter_);
    motion.yaw_rate_radps = filter_.x.value(4);
    return motion;
  }
  static constexpr auto members(auto& self) { return base::members(self.straight_, self.filter_, self.turns_); }

 private:
  void begin_to_turn(const param::TargetParameters& n);

  VelocityTracking straight_;
  filter::Ukf<State> filter_;
  bool turns_ = false;
};

/// The first measurement gives the position and begins the track; so does one after recovery.at_least refusals in a
/// row, or after target.timeout_us without any. The published yaw is the direction of the velocity.
template <class Tracking>
class TargetTracker {
 public:
  static constexpr sensor::EstimatorKind kKind = Tracking::kKind;

  void restart(base::Micros t, const Context&) {
    *this = {};
    now_ = time_ = t;
  }
  /// The target is there; its velocity is not known.
  void set_pose(base::Micros t, const SetPose& given, const Context& ctx) {
    const float sigma_m = given.sigma_position_m > kFinest_m ? given.sigma_position_m : kFinest_m;
    begin(t, given.pose.x.minus({}), given.pose.y.minus({}), sigma_m, ctx);
  }
  void advance(base::Micros t, const Context&) { now_ = t; }

  Innovation fuse(const sensor::LandmarkSighting& sighting, base::Micros stamp, const Context& ctx);

  [[nodiscard]] Estimate estimate(const Context& ctx) const;
  [[nodiscard]] sensor::Mode mode(const Context& ctx) const {
    if (!tracks(ctx)) return sensor::Mode::kWaitingForPose;
    return refused_.count() >= 3 ? sensor::Mode::kDegraded : sensor::Mode::kNominal;
  }
  static constexpr auto members(auto& self) {
    return base::members(self.target_, self.time_, base::unhashed(self.now_), self.refused_, self.begun_);
  }

 private:
  static constexpr float kFinest_m = 1e-3F;

  [[nodiscard]] bool tracks(const Context& ctx) const {
    return begun_ && now_ - time_ <= base::Micros{ctx.parameters.target.timeout_us};
  }
  void begin(base::Micros t, float x_m, float y_m, float sigma_m, const Context& ctx) {
    target_.start(x_m, y_m, sigma_m, ctx.parameters.target);
    time_ = t;
    begun_ = true;
    refused_ = {};
  }

  Tracking target_;
  base::Micros time_;            ///< time of the state: stamp of the last measurement
  base::Micros now_;             ///< unhashed: of the last tick, set anew by the next
  checks::Persistence refused_;  ///< measurements in a row
  bool begun_ = false;
};

using VelocityTracker = TargetTracker<VelocityTracking>;
using TurnTracker = TargetTracker<TurnTracking>;

}  // namespace tetap::estimators
