// SPDX-License-Identifier: Apache-2.0
// Heading monitor: an independent estimate of the heading from how the robot moves. Before the filter it finds the
// heading. Beside a filter without wheels it judges the filter's heading, and the magnetometer's.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/checks/persistence.hpp"
#include "tetap/estimators/inertial/filter_view.hpp"
#include "tetap/model/gnss_fix_3d.hpp"
#include "tetap/nav/yaw_estimator.hpp"

namespace tetap::estimators {

class HeadingMonitor {
 public:
  static constexpr float kSigmas = 5;  ///< a heading farther off contradicts

  [[nodiscard]] nav::YawEstimator& finder() { return finder_; }
  [[nodiscard]] bool has_velocity() const { return has_velocity_; }
  void note_velocity() { has_velocity_ = true; }
  /// The monitor runs beside the filter, or did before a restart.
  [[nodiscard]] bool runs() const { return runs_; }
  void stop() { runs_ = false; }

  void predict(const nav::ImuIncrement& imu, const nav::Quaternion& q_nb) {
    if (!runs_) finder_.restart(q_nb);
    runs_ = true;
    static_cast<void>(finder_.predict(imu));
  }
  void fuse(const model::GnssFix3d& fix) {
    if (runs_ && !has_velocity_) fuse_position(fix);
  }
  void fuse_velocity(const nav::Vector3& v_n_mps, float sigma_mps, const param::GnssParameters& n) {
    if (!runs_) return;
    has_velocity_ = true;
    find_by_velocity(v_n_mps, sigma_mps, n);
  }
  void fuse_position(const model::GnssFix3d& fix) {
    finder_.fuse_position(fix.x, fix.y, fix.sigma_horizontal_m, {fix.antenna_b_m(0), fix.antenna_b_m(1)});
  }
  void find_by_velocity(const nav::Vector3& v_n_mps, float sigma_mps, const param::GnssParameters& n) {
    finder_.fuse_velocity(v_n_mps(0), v_n_mps(1), sigma_mps, {n.antenna_x_b_m, n.antenna_y_b_m});
  }

  /// Sigmas by which a heading (the filter's or a magnetometer's) is another one than the motion's; 0: it is not.
  /// Velocities pull round what is less than half a radian off.
  [[nodiscard]] float contradicts(float yaw_rad, float sigma_rad, float apart_rad = 0.5F, float least = kSigmas) const {
    if (!runs_) return 0.0F;
    const float sigmas = finder_.against(yaw_rad, sigma_rad);
    const bool is = sigmas > least && finder_.apart_rad(yaw_rad) > apart_rad;
    return is ? sigmas : 0.0F;
  }
  /// The filter's heading was contradicted for so long that the filter has to begin anew. With wheels or a speedometer
  /// by their direction of travel, else by the monitor's own heading.
  [[nodiscard]] bool heading_wrong(const FilterView& filter) {
    return persists(contradicted_by_motion(filter), filter);
  }
  /// Wheels show a wrong heading: receiver and wheels agree on a speed, but not on its direction in the body. Once is
  /// enough for a heading whose 1 sigma is half a radian: an update turns it by a part, and makes it sure. `leapt`: the
  /// receiver's velocity stepped by itself, so that once shows nothing.
  [[nodiscard]] bool direction_wrong(const nav::Vector3& v_b_mps, float level_mps, float sigma_mps, bool leapt,
                                     const FilterView& filter) {
    const bool contradicted = sideways(v_b_mps, level_mps, sigma_mps, filter);
    const bool uncertain = 1.0F - 0.5F * filter.heading_rad2() < kAhead;
    return persists(contradicted, filter) || (contradicted && uncertain && !leapt);
  }

  /// The motion's heading survives a restart of the filter.
  void copy_from(const HeadingMonitor& from) {
    if (!from.runs_) return;
    finder_ = from.finder_;
    has_velocity_ = from.has_velocity_;
    runs_ = true;
  }
  /// `aligning`: the finder looks for the first heading, whether the monitor runs or not. Otherwise a monitor that does
  /// not run restarts its finder before its next use, so that the finder is no state.
  static constexpr auto members(auto& self) {
    return base::members(self.finder_, base::in_turns(self.contradicted_), self.has_velocity_, self.runs_);
  }

 private:
  static constexpr float kAhead = 0.88F;  ///< cosine of half a radian

  [[nodiscard]] bool contradicted_by_motion(const FilterView& filter) const;
  [[nodiscard]] static bool sideways(const nav::Vector3& v_b_mps, float level_mps, float sigma_mps,
                                     const FilterView& filter);
  [[nodiscard]] bool persists(bool contradicted, const FilterView& filter) {
    constexpr base::Micros kMaxGap{2'500'000};
    const param::RecoveryParameters& n = filter.parameters().recovery;
    contradicted_.update(contradicted, filter.stamp(), kMaxGap);
    return contradicted_.persists(filter.stamp(), base::Micros{n.after_us}, n.at_least);
  }

  nav::YawEstimator finder_;
  checks::Persistence contradicted_;  ///< tests in a row that contradicted the filter's heading
  bool has_velocity_ = false;         ///< the receiver gives a velocity: its positions are left out
  bool runs_ = false;                 ///< the monitor runs beside the filter, or did before a restart
};

/// A magnetometer that is not trusted may have led the heading astray. Velocities alone may not pull so sure a heading
/// round: then a smaller difference counts.
inline bool HeadingMonitor::contradicted_by_motion(const FilterView& filter) const {
  constexpr float kSuspectMagnetometer_rad = 0.1F, kSuspectMagnetometerSigmas = 3.0F;
  const float yaw_rad = nav::euler(filter.x().q_nb).yaw_rad, sigma_rad = base::sqrt(filter.heading_rad2());
  const float sigmas = filter.magnetometer_is_suspect()
                           ? contradicts(yaw_rad, sigma_rad, kSuspectMagnetometer_rad, kSuspectMagnetometerSigmas)
                           : contradicts(yaw_rad, sigma_rad);
  return sigmas > 0.0F;
}

/// Nothing drives half a radian sideways: where receiver and wheels agree on the speed, the filter's heading is wrong.
inline bool HeadingMonitor::sideways(const nav::Vector3& v_b_mps, float level_mps, float sigma_mps,
                                     const FilterView& filter) {
  const float wheels = filter.recent_forward_mps();
  const float forward = wheels < 0.0F ? -v_b_mps(0) : v_b_mps(0);
  return level_mps > 4.0F * sigma_mps + 0.3F &&
         base::abs(level_mps - base::abs(wheels)) < 3.0F * sigma_mps + 0.05F * level_mps &&
         forward < kAhead * level_mps - sigma_mps;
}

}  // namespace tetap::estimators
