// SPDX-License-Identifier: Apache-2.0
// Inertial navigation: start, pose from outside, restart.
#include "tetap/estimators/inertial/inertial.hpp"
#include "tetap/model/dual_heading.hpp"

namespace tetap::estimators {

template <class Watch>
void InertialWith<Watch>::restart(base::Micros t, const Context& ctx) {
  base::reinitialise(*this);
  time_ = t;
  set_noise(ctx.parameters.inertial);
  if (ctx.parameters.start.known == 0) return;
  const SetPose start = start_pose(ctx.parameters.start);
  alignment_.place(start.pose, start.sigma_position_m, start.sigma_yaw_rad);
}

template <class Watch>
void InertialWith<Watch>::set_pose(base::Micros, const SetPose& given, const Context& ctx) {
  if (tracking()) alignment_.keep(ins_.x, base::sqrt(ins_.p(nav::InsState::kYaw, nav::InsState::kYaw)));
  alignment_.place(given.pose, given.sigma_position_m, given.sigma_yaw_rad);
  sources_.position.reset();
  sources_.height.reset();
  recovery_.forbid_undo();
  if (!tracking()) return;
  if (Alignment::is_heading(given.sigma_yaw_rad) && !take_heading(given)) return begin(ctx);
  Recovery::place(ins_, given.pose, given.sigma_position_m);
  watch_.begin();
  relocated();
}

/// A given heading that does not contradict the filter's own is a measurement: all else that the filter knows stays.
template <class Watch>
bool InertialWith<Watch>::take_heading(const SetPose& given) {
  constexpr float kSmall_rad = 0.3F;  // no linear step turns rightly beyond that
  if (!(ins_.p(nav::InsState::kYaw, nav::InsState::kYaw) < kSmall_rad * kSmall_rad)) return false;
  const model::DirectionMeasurement ahead =
      model::DualHeading({1.0F, 0.0F, 0.0F}, given.pose.yaw_rad, given.sigma_yaw_rad);
  return update(ahead, filter::chi_square_99(1)).verdict == filter::Verdict::kAccepted;
}

/// The filter begins where the alignment found the robot.
template <class Watch>
void InertialWith<Watch>::begin(const Context& ctx) {
  const param::InertialParameters& n = ctx.parameters.inertial;
  if (ctx.map_frame.origin != sensor::OriginSource::kNone)
    ins_.earth = nav::Earth::at(ctx.map_frame.frame, n.earth_rate != 0);
  const float forward_mps = view(time_, ctx).wheels_timed_out() ? base::kNan : sources_.forward.last_mps();
  set_level(alignment_.at().x, alignment_.at().y, alignment_.at().z, ctx);
  const Alignment::Start start =
      alignment_.start(tracking() ? &ins_.x : nullptr, level_, heading_monitor_, n, forward_mps, time_);
  Recovery::restart(ins_, start.x, start.variances);
  watch_.begin();
  phase_ = Phase::kTracking;
  standstill_.restart_means();
  sources_.begin(!alignment_.has_fixes());
  relocated();
}

/// The filter is elsewhere at once: the covariance is looked at from end to end, and the present has to follow.
template <class Watch>
void InertialWith<Watch>::relocated() {
  sources_.position.relocated(time_);
  sources_.height.relocated();
  budget_.exhaust();
  predictor_.schedule().force_rebuild();
}

/// As after power on, without a place. The size of the step is measured when the filter runs again, from the last
/// estimate. When the motion finds the heading once more, a magnetometer that led it astray has to agree first. One
/// that did not keep the heading from going astray has to agree first, too.
template <class Watch>
void InertialWith<Watch>::restart_filter(base::Micros t, sensor::ResetCause cause, const Context& ctx) {
  const auto count = static_cast<std::uint8_t>(recovery_.jump().count + 1);
  const nav::InsState last = predictor_.present();
  const HeadingMonitor before = heading_monitor_;
  const bool trusted = sources_.magnetometer.trusted();
  const nav::LocalLevel level = level_;
  base::reinitialise(*this);
  level_ = level;
  heading_monitor_.copy_from(before);
  if (heading_monitor_.runs() && (!trusted || cause == sensor::ResetCause::kHeadingWrong))
    sources_.magnetometer.distrust(t);
  time_ = t;
  set_noise(ctx.parameters.inertial);
  predictor_.set_present(last);
  recovery_.report_restart(cause, count);
}

}  // namespace tetap::estimators
