// SPDX-License-Identifier: Apache-2.0
// Recovery of a filter that is wrong: the only writer of its covariance outside of prediction and update. Three verbs:
// inflate a block, reset a block, restart.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/checks/persistence.hpp"
#include "tetap/estimators/estimate.hpp"
#include "tetap/estimators/inertial/source.hpp"
#include "tetap/nav/ins.hpp"
#include "tetap/param/parameters.hpp"

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
  /// The filter was found wrong by its sources within ten seconds: fixes decide where it is.
  [[nodiscard]] bool widened_lately(base::Micros stamp) const {
    return checks::recent(widened_at_, stamp, base::Micros{10'000'000});
  }

  /// Changes the covariance as an assessment asks. True: the present has to follow at once.
  bool apply(const Assessment& a, nav::Ins& ins, base::Micros stamp, const param::Parameters& parameters);

  /// Verb 1, of velocity and attitude: both may be off by this, too.
  static void inflate_motion(nav::Ins& ins, float sigma_mps, float sigma_rad) {
    inflate(ins, nav::InsState::kVelocity, nav::Vector3::Constant(sigma_mps * sigma_mps));
    inflate(ins, nav::InsState::kAttitude, nav::Vector3::Constant(sigma_rad * sigma_rad));
  }
  // P of a widen_*() is that of the state's time.
  /// Verb 1 by a cause: both wheels contradict the gyroscope's turn by so much.
  static void widen_turn(nav::Ins& ins, float sigma_rad, bool at_rest);
  /// Verb 1 by a cause: measurements that found the velocity turned it by more than P allowed.
  static void widen_heading(nav::Ins& ins, const nav::VelocityCorrection& sum);
  /// Verb 1 by a cause: the IMU shows an acceleration that is not there. A tilt of the last second makes it, or a bias.
  static void widen_imu(nav::Ins& ins, float east_mps2, float north_mps2);
  /// Verb 1 by a cause: climb and height are off, by an error of the accelerometer along the plumb line.
  static void widen_climb(nav::Ins& ins, float climb_mps, float height_m);
  static void inflate_heading(nav::Ins& ins, float variance_rad2) {
    ins.inflate_up(nav::InsState::kAttitude, variance_rad2);
  }
  /// Verb 2 by command: horizontal position from outside, 1 sigma per axis; all else stays.
  static void place(nav::Ins& ins, const model::PlanarPose& pose, float sigma_m) { ins.place(pose.x, pose.y, sigma_m); }
  /// Verb 3: state and independent errors anew; the third of position, velocity and attitude is along the plumb line.
  [[gnu::cold]] static void restart(nav::Ins& ins, const nav::InsState& x, const Variances& variances);

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

  static constexpr auto members(auto& self) { return base::members(self.jump_, self.widened_at_, self.undoable_); }

 private:
  static constexpr float kRefused_m2ps2 = 0.25F;  ///< added to the velocity when a refused source is right

  /// Verb 1: three errors from `first` on.
  static void inflate(nav::Ins& ins, int first, const nav::Vector3& variance) {
    for (int i = 0; i < 3; ++i) ins.inflate(first + i, variance(i));
  }
  /// Verb 2: coordinates from `first` on, moved and as uncertain as a fix, no longer correlated with anything.
  void reset_position(nav::Ins& ins, int first, int count, const nav::Vector3& by_m, const nav::Vector3& variance_m2);
  /// A source refused for so long is right, and the filter wrong, or it will refuse the source again.
  void inflate_refused(nav::Ins& ins, const param::Parameters& parameters);
  /// Verb 1 by a cause, whichever it was: each one that explains the innovation, so the next sample is taken.
  void widen(const Assessment& a, nav::Ins& ins, base::Micros stamp, const param::InertialParameters& n);
  static void widen_velocity(nav::Ins& ins, const nav::Vector3& nu, float since_s);
  static void widen_position(nav::Ins& ins, const nav::Vector3& nu, float since_s);
  [[nodiscard]] static float turn_of(const nav::Vector3& v_n_mps, float east_mps, float north_mps);
  [[nodiscard]] static std::array<float, 2> tilt_of(float east_mps2, float north_mps2, float gravity_mps2);

  Jump jump_;
  base::Micros widened_at_;  ///< stamp at which a source was last right against the filter; 0: none
  bool undoable_ = false;    ///< the last reset of the position may be taken back
};

inline void Recovery::restart(nav::Ins& ins, const nav::InsState& x, const Variances& variances) {
  constexpr std::array<int, 3> kBlocks{nav::InsState::kPosition, nav::InsState::kVelocity, nav::InsState::kAttitude};
  const bool leans = ins.earth.up_n(2) < 1.0F;
  Variances level = variances;
  for (const int first : kBlocks) {
    const auto i = static_cast<std::size_t>(first);
    if (leans) level[i + 2] = variances[i];
  }
  ins.start(x, level);
  if (!leans) return;
  for (const int first : kBlocks) {
    const auto i = static_cast<std::size_t>(first);
    ins.inflate_up(first, variances[i + 2] - variances[i]);
  }
  ins.recondition();
}

/// The coordinates from `first` on are where fixes were for long, and as uncertain as a fix.
inline void Recovery::reset_position(nav::Ins& ins, int first, int count, const nav::Vector3& by_m,
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

/// Tilt (about east, north) that makes an acceleration out of gravity, limited to what is still a small angle.
inline std::array<float, 2> Recovery::tilt_of(float east_mps2, float north_mps2, float gravity_mps2) {
  constexpr float kMost_rad = 0.5F;
  const float tilt = base::sqrt(east_mps2 * east_mps2 + north_mps2 * north_mps2) / gravity_mps2;
  const float share = (tilt > kMost_rad ? kMost_rad / tilt : 1.0F) / gravity_mps2;
  return {-north_mps2 * share, east_mps2 * share};
}

/// Turn about the vertical that makes so much of a velocity, limited to what is still a small angle.
inline float Recovery::turn_of(const nav::Vector3& v_n_mps, float east_mps, float north_mps) {
  constexpr float kMost_rad = 0.7F;
  const float v2 = v_n_mps(0) * v_n_mps(0) + v_n_mps(1) * v_n_mps(1);
  const float across = north_mps * v_n_mps(0) - east_mps * v_n_mps(1);
  if (!(base::abs(across) < kMost_rad * v2)) return across < 0.0F ? -kMost_rad : kMost_rad;
  return across / v2;
}

/// Nothing is taken out of P, so it stays positive definite without recondition(). The bias of the accelerometer is
/// that of the limited tilt.
inline void Recovery::widen_imu(nav::Ins& ins, float east_mps2, float north_mps2) {
  const float g_mps2 = ins.earth.gravity_mps2;
  const std::array<float, 2> tilt = tilt_of(east_mps2, north_mps2, g_mps2);
  ins.inflate_along({0, 0, 0, 0, 0, 0, tilt[0], tilt[1], 0});
  const nav::Vector3 turn_b = ins.x.q_nb.conjugate().rotate({tilt[0], tilt[1], 0});
  const nav::Vector3 bias_b = ins.x.q_nb.conjugate().rotate({tilt[1], -tilt[0], 0}) * g_mps2;
  for (int i = 0; i < 3; ++i) {
    ins.inflate(nav::InsState::kAccelBias + i, bias_b(i) * bias_b(i));
    ins.inflate(nav::InsState::kGyroBias + i, turn_b(i) * turn_b(i));
  }
}

/// The heading may be off by the turn that the corrections made of the velocity.
inline void Recovery::widen_heading(nav::Ins& ins, const nav::VelocityCorrection& sum) {
  const float yaw_rad = turn_of(ins.x.v_n_mps, sum.east_mps, sum.north_mps);
  inflate_heading(ins, yaw_rad * yaw_rad);
}

/// The velocity is off by nu. It leapt; or a tilt made it so, since the last agreement; or the heading is wrong.
inline void Recovery::widen_velocity(nav::Ins& ins, const nav::Vector3& nu, float since_s) {
  const float t = since_s > 0.1F ? since_s : 0.1F;
  ins.inflate_along({nu(0) * t, nu(1) * t, nu(2) * t, nu(0), nu(1), nu(2), 0, 0, 0});
  const std::array<float, 2> tilt = tilt_of(nu(0) / t, nu(1) / t, ins.earth.gravity_mps2);
  ins.inflate_along({0.5F * nu(0) * t, 0.5F * nu(1) * t, 0, nu(0), nu(1), 0, tilt[0], tilt[1], 0});
  const float ve = ins.x.v_n_mps(0), vn = ins.x.v_n_mps(1), v2 = ve * ve + vn * vn;
  if (v2 > 1.0F) {
    const float yaw = turn_of(ins.x.v_n_mps, nu(0), nu(1));
    ins.inflate_along({-yaw * vn * t, yaw * ve * t, 0, -yaw * vn, yaw * ve, 0, 0, 0, yaw});
  }
  ins.recondition();
}

/// The position is off by nu. It leapt; or the velocity was wrong since the last agreement; or a tilt.
inline void Recovery::widen_position(nav::Ins& ins, const nav::Vector3& nu, float since_s) {
  const float t = since_s > 0.2F ? since_s : 0.2F;
  ins.inflate_along({nu(0), nu(1), nu(2), 0, 0, 0, 0, 0, 0});
  ins.inflate_along({nu(0), nu(1), nu(2), nu(0) / t, nu(1) / t, nu(2) / t, 0, 0, 0});
  const float e = 2.0F * nu(0) / t, n = 2.0F * nu(1) / t;
  const std::array<float, 2> tilt = tilt_of(e / t, n / t, ins.earth.gravity_mps2);
  ins.inflate_along({nu(0), nu(1), 0, e, n, 0, tilt[0], tilt[1], 0});
  ins.recondition();
}

/// The climb is off, and the height by what came of it: an accelerometer errs along the plumb line. Its error made the
/// climb in a second or longer.
inline void Recovery::widen_climb(nav::Ins& ins, float climb_mps, float height_m) {
  constexpr float kSince_s = 1;
  const nav::Vector3& up_n = ins.earth.up_n;
  const nav::Vector3 p_m = height_m * up_n, v_mps = climb_mps * up_n;
  ins.inflate_along({p_m(0), p_m(1), p_m(2), v_mps(0), v_mps(1), v_mps(2), 0, 0, 0});
  const nav::Vector3 bias_b = ins.x.q_nb.conjugate().rotate((1.0F / kSince_s) * v_mps);
  for (int i = 0; i < 3; ++i) ins.inflate(nav::InsState::kAccelBias + i, bias_b(i) * bias_b(i));
  ins.recondition();
}

/// The heading is at least so uncertain. An error of the gyroscope made what it lacks, in no less than a second: the
/// bias is off by as many radians a second as the heading by radians. At rest a zero-rate update may show the bias once
/// the error has ended: the heading keeps its own share. Nothing is taken out of P: no recondition().
inline void Recovery::widen_turn(nav::Ins& ins, float sigma_rad, bool at_rest) {
  constexpr int kYaw = nav::InsState::kYaw, kBias = nav::InsState::kGyroBias;
  const nav::Vector3 up_b = ins.x.q_nb.conjugate().rotate(ins.earth.up_n);
  float shared = 0, bias_radps2 = 0;  // covariance of heading and the bias along up, and the latter's variance
  for (int i = 0; i < 3; ++i) {
    shared += ins.p(kYaw, kBias + i) * up_b(i);
    for (int j = 0; j < 3; ++j) bias_radps2 += ins.p(kBias + i, kBias + j) * up_b(i) * up_b(j);
  }
  const float by_bias_rad2 = at_rest && bias_radps2 > 0.0F ? shared * shared / bias_radps2 : 0.0F;
  const float lacking_rad2 = sigma_rad * sigma_rad - (ins.p(kYaw, kYaw) - by_bias_rad2);
  if (!(lacking_rad2 > 0.0F)) return;
  inflate_heading(ins, lacking_rad2);
  for (int i = 0; i < 3; ++i) ins.inflate(kBias + i, lacking_rad2 * up_b(i) * up_b(i));
}

/// Once more within ten seconds, it is not one of these causes alone: tilt and bias are as at the start.
inline void Recovery::widen(const Assessment& a, nav::Ins& ins, base::Micros stamp,
                            const param::InertialParameters& n) {
  if (a.action == Action::kWidenPosition) {
    widen_position(ins, a.remedy.innovation, a.remedy.since_s);
  } else {
    widen_velocity(ins, a.remedy.innovation, a.remedy.since_s);
    if (widened_lately(stamp)) {
      const float tilt = n.start_tilt_rad, bias = n.accel_turn_on_mps2;
      inflate(ins, nav::InsState::kAccelBias, nav::Vector3::Constant(bias * bias));
      inflate(ins, nav::InsState::kAttitude, {tilt * tilt, tilt * tilt, 0.0F});
    }
  }
  widened_at_ = stamp;
}

inline bool Recovery::apply(const Assessment& a, nav::Ins& ins, base::Micros stamp,
                            const param::Parameters& parameters) {
  inflate(ins, nav::InsState::kPosition,
          {a.remedy.pulled_m[0] * a.remedy.pulled_m[0], a.remedy.pulled_m[1] * a.remedy.pulled_m[1], 0.0F});
  switch (a.action) {
    case Action::kWidenVelocity:
    case Action::kWidenPosition:
      widen(a, ins, stamp, parameters.inertial);
      return true;
    case Action::kWidenClimb:
      widen_climb(ins, a.remedy.climb_mps, a.remedy.height_m);
      return true;
    case Action::kInflateMotion:
      inflate_refused(ins, parameters);
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
inline void Recovery::measure_step(const nav::InsState& from, const nav::InsState& to) {
  jump_.east_m = nav::difference(to.x, from.x);
  jump_.north_m = nav::difference(to.y, from.y);
  jump_.up_m = nav::difference(to.z, from.z);
  jump_.yaw_rad = base::wrap_angle(nav::euler(to.q_nb).yaw_rad - nav::euler(from.q_nb).yaw_rad);
}

}  // namespace tetap::estimators
