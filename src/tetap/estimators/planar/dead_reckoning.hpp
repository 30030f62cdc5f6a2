// SPDX-License-Identifier: Apache-2.0
// Pose from wheels, and from a gyroscope where the robot has one: the motion half that every planar estimator shares.
// The state only changes when a sample is fused. advance() moves the time for which estimate() extrapolates. A tick
// never splits an integration, and the pose after n counts is the textbook's to the bit.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/estimators/estimate.hpp"
#include "tetap/estimators/planar/planar_ekf.hpp"
#include "tetap/filter/covariance_access.hpp"
#include "tetap/model/planar_increment.hpp"
#include "tetap/param/parameters.hpp"
#include "tetap/sensor/samples.hpp"

#include <cstdint>

namespace tetap::estimators {

/// Filter: what carries pose and covariance along an increment (filter::Ekf, Ukf, UkfSqrt of model::PlanarPose).
template <class Filter>
class PlanarDeadReckoning {
 public:
  Filter filter;

  void start(base::Micros t, const model::PlanarPose& pose, float sigma_position_m, float sigma_yaw_rad) {
    filter.x = pose;
    filter.x.yaw_rad = base::wrap_angle(pose.yaw_rad);
    set_error(sigma_position_m, sigma_yaw_rad);
    if (t > time_) time_ = t;
    untravelled();
  }

  void advance(base::Micros t) { out_time_ = t; }

  /// The pose of now becomes certain: the origin of a frame of its own.
  void forget_error() { set_error(kFinest_m, kFinest_rad); }
  /// The pose of now is another one; what the wheels did since their last sample stays in it.
  void relocate(const model::PlanarPose& pose, float sigma_position_m, float sigma_yaw_rad) {
    filter.x = pose;
    set_error(sigma_position_m, sigma_yaw_rad);
  }
  /// The heading of today becomes the x axis of a frame of its own: known there, and apart from the position.
  void forget_heading() {
    const auto& p = covariance_of(filter);
    set_covariance(filter, filter::Symmetric<float, 3>::diagonal({p(0, 0), p(1, 1), kFinest_rad * kFinest_rad}));
  }

  /// The verdict is kNotUsed when this robot has no use for the sample (a speed without a turn, an IMU that is not
  /// used). A step of counts that no wheel can do is kRejected. The held speeds stand for a rejected step, and the
  /// counters begin anew.
  sensor::Verdict fuse(const sensor::WheelCounts& now, base::Micros stamp, const param::Parameters& n);
  sensor::Verdict fuse(const sensor::WheelSpeeds& speeds, base::Micros stamp, const param::Parameters& n) {
    return fuse_speed({.kind = Held::Kind::kWheels, .first_mps = speeds.left_mps, .second = speeds.right_mps}, stamp,
                      n);
  }
  sensor::Verdict fuse(const sensor::BodySpeed& speed, base::Micros stamp, const param::Parameters& n) {
    // A speedometer alone does not measure the turn: a gyroscope has to.
    const bool turns = base::is_finite(speed.yaw_rate_radps);
    if (!turns && n.gyro.use == 0) return sensor::Verdict::kNotUsed;
    return fuse_speed(
        {.kind = Held::Kind::kBody, .first_mps = speed.forward_mps, .second = turns ? speed.yaw_rate_radps : 0.0F},
        stamp, n);
  }
  sensor::Verdict fuse(const sensor::ImuSample& sample, base::Micros stamp, const param::Parameters& n);

  /// Turn rates as the wheels and as the gyroscope showed them last.
  [[nodiscard]] float wheels_turn_radps(const param::Parameters& n) const {
    return held_.kind == Held::Kind::kWheels ? (held_.second - held_.first_mps) / n.wheels.drive.track_m : held_.second;
  }
  [[nodiscard]] float gyro_turn_radps() const { return gyro_rate_radps_; }
  /// The gyroscope's last turn rate holds at t; after the time-out of wheels the wheels show the turn.
  [[nodiscard]] bool gyro_shows(base::Micros t, const param::Parameters& n) const {
    return n.gyro.use != 0 && t - gyro_time_ <= base::Micros{n.wheels.timeout_us};
  }
  /// Wheels or a speed showed the motion until t.
  [[nodiscard]] bool measured(base::Micros t, const param::Parameters& n) const {
    return held_.kind != Held::Kind::kNone && t - last_input_ <= base::Micros{n.wheels.timeout_us};
  }
  /// Forward speed as the wheels showed it last.
  [[nodiscard]] float wheels_forward_mps() const { return forward_mps(); }

  /// Brings the state to t with what is held; called before a measurement is fused at its own time.
  void propagate(base::Micros t, const param::Parameters& n);

  /// State and covariance extrapolated to the time of the last advance().
  [[nodiscard]] Estimate estimate(const param::Parameters& n) const;
  [[nodiscard]] MotionVariance motion_variance(const param::Parameters& n) const;

  static constexpr auto members(auto& self) {
    return base::members(self.filter, self.time_, base::unhashed(self.out_time_), self.last_input_, self.counts_time_,
                         self.still_since_, self.held_, self.counts_, self.have_counts_, self.moving_,
                         self.applied_left_m_, self.applied_right_m_, self.gyro_time_, self.applied_yaw_rad_,
                         self.gyro_rate_radps_, self.gyro_bias_radps_);
  }

 private:
  /// A sigma of 0 on the bus means less than half a step of the signal; and the covariance has to stay positive.
  static constexpr float kFinest_m = 0.5e-3F, kFinest_rad = 0.1e-3F;

  /// Last measured speeds; the robot is assumed to keep them.
  struct Held {
    enum class Kind : std::uint8_t { kNone, kBody, kWheels };
    Kind kind = Kind::kNone;
    float first_mps = 0;  ///< forward speed, or the left wheel's
    float second = 0;     ///< yaw rate [rad/s], or the right wheel's speed
  };

  void set_error(float sigma_position_m, float sigma_yaw_rad) {
    const float position_m = sigma_position_m > kFinest_m ? sigma_position_m : kFinest_m;
    const float yaw_rad = sigma_yaw_rad > kFinest_rad ? sigma_yaw_rad : kFinest_rad;
    const float variance = position_m * position_m;
    set_covariance(filter, filter::Symmetric<float, 3>::diagonal({variance, variance, yaw_rad * yaw_rad}));
  }
  sensor::Verdict fuse_speed(const Held& held, base::Micros stamp, const param::Parameters& n);
  /// The held speeds are recent enough to be called the motion.
  [[nodiscard]] bool fresh(const param::Parameters& n) const {
    return held_.kind != Held::Kind::kNone && out_time_ - last_input_ <= base::Micros{n.wheels.timeout_us};
  }
  [[nodiscard]] float forward_mps() const {
    return held_.kind == Held::Kind::kWheels ? 0.5F * (held_.first_mps + held_.second) : held_.first_mps;
  }
  [[nodiscard]] float yaw_rate_radps(const param::Parameters& n) const {
    if (gyro_shows(out_time_, n)) return gyro_rate_radps_;
    return wheels_turn_radps(n);
  }
  /// `gyro`: the gyroscope shows the turn.
  [[nodiscard]] model::PlanarIncrement held_increment(float dt_s, bool gyro, const param::Parameters& n) const;
  /// Calls predict(increment, seconds of held speeds, whether the gyroscope shows the turn) for what is held from the
  /// state's time to t: the held speeds, then the span after their time-out.
  template <class Predict>
  void each_held(base::Micros t, const param::Parameters& n, Predict&& predict) const;
  /// Brings the state to t but for its last increment, which the caller predicts with what a sample adds to it.
  [[nodiscard]] model::PlanarIncrement take_held(base::Micros t, const param::Parameters& n);
  static void turn(model::PlanarIncrement& increment, float dyaw_rad, float variance) {
    increment.dyaw_rad = dyaw_rad;
    increment.var_dyaw = variance;
    increment.cov_ds_dyaw = 0;
  }
  void untravelled() { applied_left_m_ = applied_right_m_ = 0; }

  base::Micros time_;        ///< time of the state
  base::Micros out_time_;    ///< time of the estimate; unhashed: set anew by each tick
  base::Micros last_input_;  ///< stamp of the last wheel sample
  base::Micros counts_time_;
  base::Micros still_since_;
  Held held_;
  sensor::WheelCounts counts_;
  bool have_counts_ = false;
  bool moving_ = true;
  float applied_left_m_ = 0;  ///< travel extrapolated since the last counts, taken off when the next ones come
  float applied_right_m_ = 0;
  base::Micros gyro_time_;     ///< stamp of the last IMU sample
  float applied_yaw_rad_ = 0;  ///< turn extrapolated since then
  float gyro_rate_radps_ = 0;
  float gyro_bias_radps_ = 0;
};

using DeadReckoning = PlanarDeadReckoning<PlanarEkf>;

}  // namespace tetap::estimators
