// SPDX-License-Identifier: Apache-2.0
// Odometry: dead reckoning alone, continuous and without jumps (REP-105 "odom").
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/estimators/context.hpp"
#include "tetap/estimators/planar/dead_reckoning.hpp"

namespace tetap::estimators {

class Odometry {
 public:
  static constexpr sensor::EstimatorKind kKind = sensor::EstimatorKind::kOdometry;

  void restart(base::Micros t, const Context& ctx) {
    *this = {};
    bound_ = ctx.parameters.start.known != 0;
    motion_.start(t, bound_ ? start_pose(ctx.parameters.start).pose : model::PlanarPose{}, kStartSigma, kStartSigma);
  }
  void set_pose(base::Micros t, const SetPose& given, const Context& ctx) {
    motion_.propagate(t, ctx.parameters);
    motion_.start(t, given.pose, given.sigma_position_m, given.sigma_yaw_rad);
    bound_ = true;
  }

  void advance(base::Micros t, const Context&) { motion_.advance(t); }

  template <class Input>
  requires requires(DeadReckoning& motion, const Input& input, const param::Parameters& n) {
    motion.fuse(input, base::Micros{}, n);
  }
  Innovation fuse(const Input& input, base::Micros stamp, const Context& ctx) {
    return input_record(motion_.fuse(input, stamp, ctx.parameters));
  }

  /// Counted from where it began; valid as a place on the map once that is known.
  [[nodiscard]] Estimate estimate(const Context& ctx) const {
    Estimate estimate = motion_.estimate(ctx.parameters);
    estimate.position_valid = estimate.heading_valid = bound_;
    return estimate;
  }
  [[nodiscard]] MotionVariance motion_variance(const Context& ctx) const {
    return motion_.motion_variance(ctx.parameters);
  }
  [[nodiscard]] sensor::Mode mode(const Context&) const { return sensor::Mode::kDeadReckoning; }
  static constexpr auto members(auto& self) { return base::members(self.motion_, self.bound_); }

 private:
  static constexpr float kStartSigma =
      1e-3F;  // a millimetre and a milliradian: of the definition of the origin, not of the world
  DeadReckoning motion_;
  bool bound_ = false;
};

}  // namespace tetap::estimators
