// SPDX-License-Identifier: Apache-2.0
// Recovery of a filter that is wrong: the only writer of its covariance outside of prediction and update. Three verbs:
// inflate a block, reset a block, restart.
#pragma once

#include "estimators/estimate.hpp"
#include "estimators/inertial/source.hpp"
#include "nav/ins.hpp"
#include "param/parameters.hpp"

#include <array>
#include <cstdint>

namespace tetap::estimators {

class Recovery {
 public:
  using Variances = std::array<float, nav::InsState::kErrors>;

  /// The last step of position, height or heading that no measurement made.
  [[nodiscard]] const Jump& jump() const { return jump_; }
  /// Returning to where the last position reset came from is one more agreement: the reset was wrong.
  [[nodiscard]] bool undoable() const { return undoable_; }
  /// The velocity was inflated so often while fixes were refused: the filter is wrong about more than its velocity.
  [[nodiscard]] bool exhausted() const { return velocity_attempts_ >= kMostAttempts; }
  void position_fused() { velocity_attempts_ = 0; }

  /// What an assessment asks of the covariance. True: position or height was reset.
  bool apply(const Assessment& a, nav::Ins& ins, const param::Parameters& parameters);

  /// Verb 1, of velocity and attitude: both may be off by this, too.
  static void inflate_motion(nav::Ins& ins, float sigma_mps, float sigma_rad) {
    inflate(ins, nav::InsState::kVelocity, nav::Vector3::Constant(sigma_mps * sigma_mps));
    inflate(ins, nav::InsState::kAttitude, nav::Vector3::Constant(sigma_rad * sigma_rad));
  }
  static void inflate_heading(nav::Ins& ins, float variance_rad2) {
    ins.inflate(nav::InsState::kAttitude + 2, variance_rad2);
  }
  /// Verb 2 by command: horizontal position from outside, 1 sigma per axis; all else stays.
  static void place(nav::Ins& ins, const model::PlanarPose& pose, float sigma_m) { ins.place(pose.x, pose.y, sigma_m); }
  /// Verb 3: state and independent errors anew.
  static void restart(nav::Ins& ins, const nav::InsState& x, const Variances& variances) { ins.start(x, variances); }

  /// A source was taken anew, and nothing moves at once: the sizes stay those of the last step.
  void report(sensor::ResetCause cause) {
    jump_.cause = cause;
    jump_.count = static_cast<std::uint8_t>(jump_.count + 1);
  }
  /// The filter begins anew for the `count`-th time; the size of the step is not known yet.
  void report_restart(sensor::ResetCause cause, std::uint8_t count) {
    jump_ = {.east_m = base::kNan,
             .north_m = base::kNan,
             .up_m = base::kNan,
             .yaw_rad = base::kNan,
             .cause = cause,
             .count = count};
  }
  [[nodiscard]] bool step_unknown() const { return !base::is_finite(jump_.yaw_rad); }
  void measure_step(const nav::InsState& from, const nav::InsState& to);
  void forbid_undo() { undoable_ = false; }

  template <class Sink>
  void hash_state(Sink&& sink) const {
    for (const float v : {jump_.east_m, jump_.north_m, jump_.up_m, jump_.yaw_rad}) sink(v);
    sink(static_cast<std::uint32_t>(jump_.cause));
    sink(static_cast<std::uint32_t>(jump_.count | (undoable_ ? 256U : 0U)));
    sink(std::uint32_t{velocity_attempts_});
  }

 private:
  static constexpr std::uint8_t kMostAttempts = 3;
  static constexpr float kRefused_m2ps2 = 0.25F;  ///< added to the velocity when a refused source is right

  /// Verb 1: three errors from `first` on.
  static void inflate(nav::Ins& ins, int first, const nav::Vector3& variance) {
    for (int i = 0; i < 3; ++i) ins.inflate(first + i, variance(i));
  }
  /// Verb 2: coordinates from `first` on, moved and as uncertain as a fix, no longer correlated with anything.
  void reset_position(nav::Ins& ins, int first, int count, const nav::Vector3& by_m, const nav::Vector3& variance_m2);
  /// A source refused for so long is right, and the filter wrong, or it will refuse the source again.
  void inflate_refused(nav::Ins& ins, const param::Parameters& parameters);
  void inflate_by_velocity(const Assessment& a, nav::Ins& ins, const param::InertialParameters& n);

  Jump jump_;
  std::uint8_t velocity_attempts_ = 0;  ///< inflations of the velocity since a fix was accepted
  bool undoable_ = false;               ///< the last reset of the position may be taken back
};

/// The coordinates from `first` on are where fixes were for long, and as uncertain as a fix.
[[gnu::noinline]] inline void Recovery::reset_position(nav::Ins& ins, int first, int count, const nav::Vector3& by_m,
                                                       const nav::Vector3& variance_m2) {
  const std::array<base::Anchored*, 3> coordinates{&ins.x.x, &ins.x.y, &ins.x.z};
  for (int i = first; i < first + count; ++i) {
    nav::move(*coordinates[static_cast<std::size_t>(i)], by_m(i));
    ins.reset(i, variance_m2(i));
  }
  ins.recondition();
  jump_ = {.east_m = by_m(0), .north_m = by_m(1), .up_m = by_m(2), .count = static_cast<std::uint8_t>(jump_.count + 1)};
}

inline void Recovery::inflate_refused(nav::Ins& ins, const param::Parameters& parameters) {
  inflate(ins, nav::InsState::kVelocity, nav::Vector3::Constant(kRefused_m2ps2));
  inflate_heading(ins, parameters.recovery.inflate_yaw_rad * parameters.recovery.inflate_yaw_rad);
}

/// Gravity, taken for motion, keeps pulling the velocity away: the tilt is known no better than at the start.
inline void Recovery::inflate_by_velocity(const Assessment& a, nav::Ins& ins, const param::InertialParameters& n) {
  if (!a.remedy.position_refused) {
    velocity_attempts_ = 0;
  } else if (velocity_attempts_ < 255) {
    ++velocity_attempts_;
  }
  const float tilt = n.start_tilt_rad, bias = n.accel_turn_on_mps2;
  inflate(ins, nav::InsState::kVelocity, a.remedy.innovation_mps.cwiseAbs2());
  inflate(ins, nav::InsState::kAccelBias, nav::Vector3::Constant(bias * bias));
  inflate(ins, nav::InsState::kAttitude, {tilt * tilt, tilt * tilt, 0.0F});
}

[[gnu::noinline]] inline bool Recovery::apply(const Assessment& a, nav::Ins& ins, const param::Parameters& parameters) {
  inflate(ins, nav::InsState::kPosition,
          {a.remedy.pulled_m[0] * a.remedy.pulled_m[0], a.remedy.pulled_m[1] * a.remedy.pulled_m[1], 0.0F});
  switch (a.action) {
    case Action::kInflateVelocity:
      inflate_by_velocity(a, ins, parameters.inertial);
      inflate_refused(ins, parameters);
      return false;
    case Action::kInflateMotion:
      inflate_refused(ins, parameters);
      return false;
    case Action::kInflateSpeed:
      inflate_refused(ins, parameters);
      inflate_motion(ins, a.remedy.sigma_mps, 0.0F);
      return false;
    case Action::kInflateHeading:
      inflate_heading(ins, a.remedy.sigma_rad * a.remedy.sigma_rad);
      report(a.cause);
      return false;
    case Action::kResetZero:
      report(a.cause);
      return false;
    case Action::kResetPosition:
      reset_position(ins, 0, 2, a.remedy.step_m, a.remedy.variance_m2);
      inflate_motion(ins, a.remedy.sigma_mps, 0.0F);
      inflate_heading(ins, parameters.recovery.inflate_yaw_rad * parameters.recovery.inflate_yaw_rad);
      undoable_ = !a.remedy.undoes;
      return true;
    case Action::kResetHeight:
      reset_position(ins, 2, 1, a.remedy.step_m, a.remedy.variance_m2);
      undoable_ = false;
      return true;
    default:
      return false;
  }
}

/// From the last estimate before the restart to the first after it.
[[gnu::noinline]] inline void Recovery::measure_step(const nav::InsState& from, const nav::InsState& to) {
  jump_.east_m = nav::difference(to.x, from.x);
  jump_.north_m = nav::difference(to.y, from.y);
  jump_.up_m = nav::difference(to.z, from.z);
  jump_.yaw_rad = base::wrap_angle(nav::euler(to.q_nb).yaw_rad - nav::euler(from.q_nb).yaw_rad);
}

}  // namespace tetap::estimators
