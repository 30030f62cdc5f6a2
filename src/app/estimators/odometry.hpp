// SPDX-License-Identifier: Apache-2.0
// Odometry: dead reckoning alone, continuous and without jumps (REP-105 "odom").
#pragma once

#include "app/context.hpp"
#include "app/estimators/dead_reckoning.hpp"

namespace tetap::app {

class Odometry {
 public:
  static constexpr can::EstimatorKind kKind = can::EstimatorKind::kOdometry;

  void restart(base::Micros t, const Context& with) {
    *this = {};
    const StartNumbers& s = with.numbers.start;
    const bool known = s.known != 0;
    bound_ = known;
    motion_.start(t,
                  known ? model::PlanarPose{.x = base::Anchored{}.plus(s.x_m),
                                            .y = base::Anchored{}.plus(s.y_m),
                                            .yaw_rad = s.yaw_rad}
                        : model::PlanarPose{},
                  kStartSigma, kStartSigma);
  }
  void set_pose(base::Micros t, const SetPose& given, const Context& with) {
    motion_.propagate(t, with.numbers);
    motion_.start(t, given.pose, given.sigma_position_m, given.sigma_yaw_rad);
    bound_ = true;
  }

  void advance(base::Micros t, const Context&) { motion_.advance(t); }

  template <class Input>
  requires requires(DeadReckoning& motion, const Input& input, const Numbers& n) {
    motion.fuse(input, base::Micros{}, n);
  }
  Innovation fuse(const Input& input, base::Micros stamp, const Context& with) {
    const bool used = motion_.fuse(input, stamp, with.numbers);
    return {.verdict = used ? can::Verdict::kAccepted : can::Verdict::kNotUsed};
  }

  /// Counted from where it began; valid as a place on the map once that is known.
  [[nodiscard]] Estimate estimate(const Context& with) const {
    Estimate estimate = motion_.estimate(with.numbers);
    estimate.position_valid = estimate.heading_valid = bound_;
    return estimate;
  }
  [[nodiscard]] MotionVariance motion_variance(const Context& with) const {
    return motion_.motion_variance(with.numbers);
  }
  [[nodiscard]] can::Mode mode(const Context&) const { return can::Mode::kDeadReckoning; }
  template <class Sink>
  void each_bit(Sink&& sink) const {
    motion_.each_bit(sink);
    sink(static_cast<std::uint32_t>(bound_));
  }

 private:
  static constexpr float kStartSigma =
      1e-3F;  // a millimetre and a milliradian: of the definition of the origin, not of the world
  DeadReckoning motion_;
  bool bound_ = false;
};

}  // namespace tetap::app
