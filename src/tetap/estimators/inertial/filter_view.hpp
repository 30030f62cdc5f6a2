// SPDX-License-Identifier: Apache-2.0
// Read-only view of the filter for its sources at one measurement. A fact that crosses sources is a method here, with
// one definition and one time-out; the bodies are in filter_view_facts.hpp. No source reads another one's members.
#pragma once

#include "tetap/checks/wheel_slip.hpp"
#include "tetap/estimators/context.hpp"
#include "tetap/estimators/inertial/imu_input.hpp"
#include "tetap/estimators/inertial/source.hpp"
#include "tetap/estimators/inertial/vote.hpp"
#include "tetap/nav/ins.hpp"

#include <cstdint>

namespace tetap::estimators {

class AidingSources;
class HeadingMonitor;
class Recovery;

class FilterView {
 public:
  struct Parts {
    const nav::Ins& ins;
    const ImuInput& imu;
    const AidingSources& sources;
    const HeadingMonitor& heading_monitor;
    const Recovery& recovery;
    const nav::LocalLevel& level;
    const Context& ctx;
    base::Micros time;   ///< time of the filter's state
    base::Micros stamp;  ///< time of the measurement
    bool tracking;       ///< the filter runs
  };
  explicit FilterView(const Parts& parts) : parts_(parts) {}

  [[nodiscard]] const nav::InsState& x() const { return parts_.ins.x; }
  [[nodiscard]] const nav::Ins::Covariance& p() const { return parts_.ins.p; }
  [[nodiscard]] const nav::Ins& ins() const { return parts_.ins; }
  /// Height above the level surface of the origin.
  [[nodiscard]] float height_m() const {
    const nav::InsState& at = x();
    return nav::difference(at.z, {}) + nav::level_drop_m(context().map_frame.frame.curvature(), at.x, at.y, at.z);
  }
  /// Level plane of the place, in the map.
  [[nodiscard]] const nav::LocalLevel& level() const { return parts_.level; }
  [[nodiscard]] const param::Parameters& parameters() const { return parts_.ctx.parameters; }
  [[nodiscard]] const Context& context() const { return parts_.ctx; }
  [[nodiscard]] base::Micros stamp() const { return parts_.stamp; }
  [[nodiscard]] base::Micros time() const { return parts_.time; }
  [[nodiscard]] bool tracking() const { return parts_.tracking; }

  /// Span from the last IMU sample to the measurement. The span is 0 beyond a sample or two: the last acceleration and
  /// turn rate do not hold any more there.
  [[nodiscard]] float later_s() const {
    constexpr base::Micros kMost{20'000};
    const base::Micros later = parts_.stamp - parts_.time;
    return later < kMost && base::Micros{0} - later < kMost ? base::seconds(later) : 0.0F;
  }
  /// Turn rate as the gyroscope shows it, with its bias.
  [[nodiscard]] const nav::Vector3& rate_b_radps() const { return parts_.imu.rate_b_radps(); }
  /// Turn rate without the bias.
  [[nodiscard]] nav::Vector3 turn_b_radps() const { return parts_.imu.rate_b_radps() - parts_.ins.x.b_g_radps; }
  [[nodiscard]] float forward_mps() const { return parts_.ins.x.q_nb.rotated_x().dot(parts_.ins.x.v_n_mps); }
  /// Variance of the heading, limited to that of a small angle: an unknown heading turns a velocity by one radian.
  [[nodiscard]] float heading_rad2() const {
    const float variance = parts_.ins.p(nav::InsState::kYaw, nav::InsState::kYaw);
    return variance < 1.0F ? variance : 1.0F;
  }
  /// Velocity of the middle of the axle by the receiver's velocity of its antenna, along the body's axes.
  [[nodiscard]] nav::Vector3 axle_mps(const nav::Vector3& v_n_mps) const;

  /// The filter's last step was without IMU.
  [[nodiscard]] bool imu_missing() const { return parts_.imu.missing(parts_.time); }
  /// No wheels and no speedometer for 1.5 s (a speedometer may come once a second): the IMU alone carries the filter.
  [[nodiscard]] bool wheels_timed_out() const;
  /// Wheels came within 1 s, do not spin, and the filter goes as fast as they do. Not for ever: the filter may be
  /// pinned to them on a ferry, and fixes that were refused for long are right.
  [[nodiscard]] bool wheels_agree() const;
  /// Wheels without slip have shown the turn rate within 0.2 s.
  [[nodiscard]] bool wheels_show_turn() const;
  [[nodiscard]] checks::WheelSlip::Slip slip() const;
  /// The last forward speed of wheels or speedometer; 0 when older than 0.5 s.
  [[nodiscard]] float recent_forward_mps() const;
  /// Encoders counted within 0.1 s; then they decide whether the robot stands.
  [[nodiscard]] bool encoders_count() const;
  /// Encoders have not moved for 0.5 s, and no wheel slips.
  [[nodiscard]] bool encoders_rest() const;
  /// The receiver repeats a position.
  [[nodiscard]] bool position_frozen() const;
  /// Fixes were refused for so long that the receiver alone is right.
  [[nodiscard]] bool position_refused_for_long() const;
  /// A fix was fused within RecoveryParameters::after_us: the filter's heading is better than a magnetometer's.
  [[nodiscard]] bool position_holds_heading() const;
  /// Votes on what is refused since then: by the wheels or the speedometer, and by the receiver's velocity. The fixes
  /// vote on a velocity that is off by nu. Wheels that fixes contradicted for long do not vouch any more.
  [[nodiscard]] Vote wheels_vote(base::Micros since) const;
  [[nodiscard]] Vote velocity_vote(base::Micros since) const;
  [[nodiscard]] Vote fixes_vote(base::Micros since, const nav::Vector3& nu_mps) const;
  /// The receiver goes ahead as fast as the wheels roll.
  [[nodiscard]] bool speeds_agree() const;
  /// A velocity contradicts the filter of late, and where two do, they agree with each other.
  [[nodiscard]] bool speeds_contradict() const;
  /// Climb rate that the filter lacks, as the receiver's velocities show it; 0 where they fit, or are not there.
  [[nodiscard]] float missing_climb_mps() const;
  /// The barometer agrees with the height, though a climb that is off by so much since then would show. Not for ever:
  /// fixes that were refused for long are right.
  [[nodiscard]] bool barometer_vouches(float climb_mps, base::Micros since) const;
  /// The last fixes leapt away from the filter, as the IMU did not feel it.
  [[nodiscard]] bool receiver_leapt() const;
  /// Difference of the receiver's last velocity to the filter's.
  [[nodiscard]] const nav::Vector3& velocity_difference_mps() const;
  /// A receiver's velocity came within 1 s.
  [[nodiscard]] bool velocity_recent() const;
  /// A magnetometer that is not trusted may have led the heading.
  [[nodiscard]] bool magnetometer_is_suspect() const;
  [[nodiscard]] const HeadingMonitor& heading_monitor() const { return parts_.heading_monitor; }
  [[nodiscard]] const Recovery& recovery() const { return parts_.recovery; }

 private:
  Parts parts_;
};

}  // namespace tetap::estimators
