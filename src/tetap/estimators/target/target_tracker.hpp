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

namespace tetap::estimators {

/// Constant velocity, state (x, vx, y, vy), extended Kalman filter; the acceleration is white noise per axis.
struct VelocityTracking {
  static constexpr sensor::EstimatorKind kKind = sensor::EstimatorKind::kEkf;
  using Filter = filter::Viewable<filter::Ekf<filter::VectorState<float, 4>>>;

  [[nodiscard]] static model::ConstantVelocity<float> motion(float dt_s, const param::TargetParameters& n) {
    return {.dt_s = dt_s, .acceleration_variance = n.acceleration_mps2 * n.acceleration_mps2};
  }
  static void start(Filter& filter, float x_m, float y_m, float sigma_m, const param::TargetParameters& n) {
    const float place = sigma_m * sigma_m, speed = n.sigma_speed_mps * n.sigma_speed_mps;
    filter.x.value = {x_m, 0, y_m, 0};
    filter.p = filter::Symmetric<float, 4>::diagonal({place, speed, place, speed});
  }
  [[nodiscard]] static float yaw_rate_radps(const Filter&) { return 0; }
};

/// Constant turn rate and velocity, state (x, y, speed, yaw, yaw rate), unscented Kalman filter.
struct TurnTracking {
  static constexpr sensor::EstimatorKind kKind = sensor::EstimatorKind::kUkf;
  using Filter = filter::Ukf<model::CtrvState<float>>;

  [[nodiscard]] static model::Ctrv<float> motion(float dt_s, const param::TargetParameters& n) {
    return {.dt_s = dt_s,
            .acceleration_variance = n.acceleration_mps2 * n.acceleration_mps2,
            .yaw_acceleration_variance = n.yaw_acceleration_radps2 * n.yaw_acceleration_radps2};
  }
  static void start(Filter& filter, float x_m, float y_m, float sigma_m, const param::TargetParameters& n) {
    filter.x.value << x_m, y_m, 0, 0, 0;
    filter.p = filter::Symmetric<float, 5>::diagonal(
        {sigma_m * sigma_m, sigma_m * sigma_m, n.sigma_speed_mps * n.sigma_speed_mps, n.sigma_yaw_rad * n.sigma_yaw_rad,
         n.sigma_yaw_rate_radps * n.sigma_yaw_rate_radps});
  }
  [[nodiscard]] static float yaw_rate_radps(const Filter& filter) { return filter.x.value(4); }
};

/// The first measurement gives the position and begins the track; so does one after recovery.at_least refusals in a
/// row, or after target.timeout_us without any. The published yaw is the direction of the velocity.
template <class Tracking>
class TargetTracker {
 public:
  using Filter = typename Tracking::Filter;
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
    return base::members(self.filter_, self.time_, base::unhashed(self.now_), self.refused_, self.begun_);
  }

 private:
  static constexpr float kFinest_m = 1e-3F;

  [[nodiscard]] bool tracks(const Context& ctx) const {
    return begun_ && now_ - time_ <= base::Micros{ctx.parameters.target.timeout_us};
  }
  void begin(base::Micros t, float x_m, float y_m, float sigma_m, const Context& ctx) {
    Tracking::start(filter_, x_m, y_m, sigma_m, ctx.parameters.target);
    time_ = t;
    begun_ = true;
    refused_ = {};
  }

  Filter filter_;
  base::Micros time_;            ///< time of the state: stamp of the last measurement
  base::Micros now_;             ///< unhashed: of the last tick, set anew by the next
  checks::Persistence refused_;  ///< measurements in a row
  bool begun_ = false;
};

using VelocityTracker = TargetTracker<VelocityTracking>;
using TurnTracker = TargetTracker<TurnTracking>;

}  // namespace tetap::estimators
