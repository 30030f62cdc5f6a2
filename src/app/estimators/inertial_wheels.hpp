// SPDX-License-Identifier: Apache-2.0
// Inertial navigation, part: wheels, with the non-holonomic constraint.
#pragma once

#include "app/estimators/inertial.hpp"
#include "app/estimators/inertial_measure.hpp"
#include "model/wheel_speed.hpp"

namespace tetap::app {

inline Innovation Inertial::fuse(const WheelCounts& counts, base::Micros stamp, const Context& with) {
  const auto& drive = with.numbers.wheels.drive;
  const base::Micros interval = stamp - counts_time_;
  const bool usable = have_counts_ && interval.us > 0 && interval <= base::Micros{with.numbers.wheels.timeout_us};
  const std::int32_t left = model::count_difference(counts.left, counts_.left);
  const std::int32_t right = model::count_difference(counts.right, counts_.right);
  counts_ = counts;
  counts_time_ = stamp;
  have_counts_ = true;
  if (!usable || left != 0 || right != 0) moved_ = stamp;
  if (!usable) return {.verdict = can::Verdict::kAccepted};
  const float per_s = 1.0F / base::seconds(interval);
  return forward(
      {.mps = 0.5F * (drive.left_m(left) + drive.right_m(right)) * per_s, .sigma_mps = 0.41F * drive.left_m(1) * per_s},
      stamp, with);
}

inline Innovation Inertial::forward(const Forward& speed, base::Micros stamp, const Context& with) {
  const InertialNumbers& n = with.numbers.inertial;
  if (phase_ != Phase::kTracking) return {.verdict = can::Verdict::kAccepted};
  constrained_ = stamp;
  const float slip = n.slip_share * (speed.mps < 0 ? -speed.mps : speed.mps);
  const float sigma = base::sqrt(n.wheel_mps * n.wheel_mps + slip * slip + speed.sigma_mps * speed.sigma_mps);
  return measure(model::WheelSpeed{.forward_mps = speed.mps,
                                   .sigma_forward_mps = sigma,
                                   .sigma_lateral_mps = n.lateral_mps,
                                   .sigma_vertical_mps = n.vertical_mps,
                                   .axle_b_m = {n.axle_x_b_m, 0.0F, 0.0F},
                                   .gyro_b_radps = rate_b_radps_},
                 kWheels, n.wheel_gate_scale, stamp, with);
}

/// A wheel speed of which nothing is known: the non-holonomic constraint is what it leaves.
inline void Inertial::constrain(base::Micros stamp, const Context& with) {
  const base::Micros every{with.numbers.inertial.constrain_every_us};
  if (every.us <= 0 || stamp - constrained_ < every) return;
  constexpr float kUnknown_mps = 1e4F;
  static_cast<void>(forward({.sigma_mps = kUnknown_mps}, stamp, with));
}

}  // namespace tetap::app
