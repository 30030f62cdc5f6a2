// SPDX-License-Identifier: Apache-2.0
// Alignment: the filter's start. It levels by gravity, then waits for a place and a heading. The heading is a given
// pose's, an outside one, a magnetometer's, or the motion's (heading_monitor.hpp), forwards or in reverse. For a robot
// that starts forwards for sure the course of GNSS is enough (fast velocity, or the chord between fixes).
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/checks/coloured_noise.hpp"
#include "tetap/estimators/inertial/heading_monitor.hpp"
#include "tetap/estimators/inertial/levelling.hpp"
#include "tetap/estimators/inertial/recovery.hpp"
#include "tetap/estimators/inertial/way_course.hpp"
#include "tetap/model/gnss_course.hpp"
#include "tetap/model/gnss_fix_3d.hpp"
#include "tetap/model/planar_pose.hpp"
#include "tetap/nav/ins.hpp"

namespace tetap::estimators {

class Alignment {
 public:
  /// State and variances of a start.
  struct Start {
    nav::InsState x;
    Recovery::Variances variances;
  };

  /// An IMU sample before the filter runs; true once the attitude is level.
  bool level(const nav::ImuIncrement& imu, HeadingMonitor& monitor, const param::InertialParameters& n);
  /// Increments are missing.
  void gap(base::Micros gap, HeadingMonitor& monitor) {
    if (gap > base::Micros{100'000}) fixed_ = false;  // the robot may have turned: the way begins anew
    if (monitor.runs() || (levelling_.begun() && !headed_)) monitor.finder().predict_without_imu(gap);
  }
  /// Forward speed of wheels or speedometer.
  void forward(float mps, float sigma_mps, float axle_x_b_m, HeadingMonitor& monitor) {
    if (!headed_) monitor.finder().fuse_forward_speed(mps, sigma_mps, {axle_x_b_m, 0.0F});
  }
  /// Heading and height of a filter that runs: a pose that follows may leave them as they are.
  void keep(const nav::InsState& x, float sigma_yaw_rad) {
    set_heading(nav::euler(x.q_nb).yaw_rad, sigma_yaw_rad);
    at_.z = x.z;
  }
  void place(const model::PlanarPose& pose, float sigma_m, float sigma_yaw_rad) {
    at_ = {.x = pose.x, .y = pose.y, .z = at_.z, .sigma_horizontal_m = sigma_m, .sigma_vertical_m = 10.0F};
    placed_ = given_ = true;
    if (is_heading(sigma_yaw_rad)) set_heading(pose.yaw_rad, sigma_yaw_rad);
  }
  /// A pose with a larger sigma is a place without a heading.
  static constexpr bool is_heading(float sigma_yaw_rad) { return sigma_yaw_rad < 1.0F; }
  void fix(const model::GnssFix3d& fix, base::Micros stamp, HeadingMonitor& monitor, const param::Parameters& n);
  /// Velocity of a receiver; without has_climb its vertical part is none.
  void velocity(const nav::Vector3& v_n_mps, float sigma_mps, bool has_climb, HeadingMonitor& monitor,
                const param::Parameters& n);
  void set_heading(float yaw_rad, float sigma_rad) {
    if (!base::is_finite(yaw_rad)) return;
    yaw_rad_ = yaw_rad;
    level_yaw_rad_ = nav::euler(levelling_.attitude()).yaw_rad;
    sigma_yaw_rad_ = sigma_rad;
    headed_ = true;
  }
  /// A magnetic field in level axes that should point to angle_rad from east; a heading known otherwise stays.
  void field(const nav::Vector3& field_n, float angle_rad, float sigma_rad) {
    if (headed_ && !(sigma_rad <= sigma_yaw_rad_)) return;
    const float turn = angle_rad - base::atan2(field_n(1), field_n(0));
    set_heading(base::wrap_angle(nav::euler(levelling_.attitude()).yaw_rad + turn), sigma_rad);
  }
  [[nodiscard]] const nav::Quaternion& attitude() const { return levelling_.attitude(); }
  [[nodiscard]] bool levelling() const { return levelling_.begun(); }
  [[nodiscard]] bool placed() const { return placed_; }
  /// Place and height to begin at.
  [[nodiscard]] const model::GnssFix3d& at() const { return at_; }
  /// Fixes came before the filter began: later ones will show how the robot moves.
  [[nodiscard]] bool has_fixes() const { return has_fixes_; }
  [[nodiscard]] bool ready() const { return placed_ && headed_; }

  /// State and variances to start with, on the level plane of the place. `before`: the filter's state where it ran,
  /// whose tilt and biases stay; else null. forward_mps: of the wheels; NaN: none. `now`: time of the state.
  [[nodiscard, gnu::cold]] Start start(const nav::InsState* before, const nav::LocalLevel& place,
                                       const HeadingMonitor& monitor, const param::InertialParameters& n,
                                       float forward_mps, base::Micros now) const;

  static constexpr auto members(auto& self) {
    return base::members(self.levelling_, self.way_, self.at_, self.fixed_at_, self.v_n_mps_, self.sigma_v_mps_,
                         self.sigma_climb_mps_, self.yaw_rad_, self.sigma_yaw_rad_, self.level_yaw_rad_, self.placed_,
                         self.headed_, self.fixed_, self.given_, self.has_fixes_);
  }

 private:
  /// Forward is the direction of travel; of an arc the chord points where its middle did. (east, north): a velocity or
  /// a chord.
  void course(float east, float north, float sigma, float turned_rad = 0.0F, float bias_rad = 0.0F) {
    const float length = base::sqrt(east * east + north * north);
    constexpr float kSlip_rad = 0.1F;             // a crab's walk
    const float uneven_rad = 0.25F * turned_rad;  // not all of a way is an arc
    const model::GnssCourse course(east / length, north / length, sigma / length,
                                   base::sqrt(kSlip_rad * kSlip_rad + uneven_rad * uneven_rad + bias_rad * bias_rad));
    set_heading(base::wrap_angle(course.angle_rad + 0.5F * turned_rad), course.sigma_rad);
  }
  void take_place(const model::GnssFix3d& fix, const param::GnssParameters& n);

  static constexpr float kFastest_mps = 200;  ///< no wheels roll faster: a broken reading
  static constexpr float kSlip_mps = 3;       ///< 1 sigma of wheels that slip or were read a second ago
  static constexpr float kUnseen_mps = 15, kUnseenClimb_mps = 5;  ///< 1 sigma of a speed that nothing showed

  Levelling levelling_;
  WayCourse way_;
  model::GnssFix3d at_;    ///< place and height to begin at
  base::Micros fixed_at_;  ///< stamp of the last fix; 0: none
  nav::Vector3 v_n_mps_ = nav::Vector3::Zero();
  float sigma_v_mps_ = 3, sigma_climb_mps_ = 3;
  float yaw_rad_ = 0, sigma_yaw_rad_ = 3;  ///< heading as found
  float level_yaw_rad_ = 0;                ///< heading of the levelled attitude when the heading was found
  bool placed_ = false;                    ///< a place is known
  bool headed_ = false;                    ///< a heading is known
  bool fixed_ = false;                     ///< the last fix belongs to the way
  bool given_ = false;                     ///< the place is from outside
  bool has_fixes_ = false;                 ///< a fix came
};

inline bool Alignment::level(const nav::ImuIncrement& imu, HeadingMonitor& monitor,
                             const param::InertialParameters& n) {
  const Levelling::Step step = levelling_.update(imu, n.level_s);
  if (step.first) level_yaw_rad_ = nav::euler(levelling_.attitude()).yaw_rad;
  if (!step.used) return step.level;
  if (step.just_level && !monitor.runs()) {
    monitor.finder().restart(levelling_.attitude());
  } else if (monitor.runs() || (step.level && !headed_)) {
    static_cast<void>(monitor.finder().predict(imu));
    if (step.level && !headed_ && monitor.finder().ready())
      set_heading(monitor.finder().yaw_rad(), monitor.finder().sigma_rad());
  }
  return step.level;
}

inline void Alignment::fix(const model::GnssFix3d& fix, base::Micros stamp, HeadingMonitor& monitor,
                           const param::Parameters& n) {
  const float dt_s = base::seconds(stamp - fixed_at_);
  if (fixed_ && !given_ && !monitor.has_velocity() && dt_s > 0.01F && dt_s < 5.0F) {  // between the last two fixes
    v_n_mps_ = nav::Vector3{fix.x.minus(at_.x), fix.y.minus(at_.y), 0.0F} / dt_s;
    sigma_v_mps_ = 1.5F * fix.sigma_horizontal_m / dt_s + 2.0F;
    sigma_climb_mps_ = kUnseenClimb_mps;
  }
  fixed_at_ = stamp;
  const float yaw_rad = nav::euler(levelling_.attitude()).yaw_rad;
  WayCourse::Way way = way_.turned(yaw_rad);
  if (n.inertial.starts_forward != 0 && fixed_ && !headed_) {
    way_.measure(way, fix, dt_s, n);
    if (way.is_course) course(way.east_m, way.north_m, 1.5F * fix.sigma_horizontal_m, way.turned_rad, way.bias_rad);
  }
  // A fix as far away as that is a course at the next one, or an outlier.
  if (!headed_ && !monitor.has_velocity() && !way.far) monitor.fuse_position(fix);
  way_.extend_or_restart(way, fix, yaw_rad, !fixed_);
  fixed_ = has_fixes_ = true;
  take_place(fix, n.gnss);
}

/// A place from outside that is better stays, and takes the height alone.
inline void Alignment::take_place(const model::GnssFix3d& fix, const param::GnssParameters& n) {
  const float inflation = n.correlation_s > 0.0F ? checks::kStartPositionInflation : 1.0F;
  if (given_ && headed_ && at_.sigma_horizontal_m < fix.sigma_horizontal_m) {
    at_.z = fix.z;
  } else {
    at_ = fix;
    at_.sigma_horizontal_m *= inflation;
    placed_ = true;
    given_ = false;
  }
  at_.sigma_vertical_m = inflation * fix.sigma_vertical_m;
}

inline void Alignment::velocity(const nav::Vector3& v_n_mps, float sigma_mps, bool has_climb, HeadingMonitor& monitor,
                                const param::Parameters& n) {
  monitor.note_velocity();
  v_n_mps_ = v_n_mps;
  if (!has_climb) v_n_mps_(2) = 0.0F;
  sigma_v_mps_ = sigma_mps;
  sigma_climb_mps_ = has_climb ? sigma_mps : kUnseenClimb_mps;
  const float speed2 = v_n_mps(0) * v_n_mps(0) + v_n_mps(1) * v_n_mps(1);
  if (speed2 > 0.25F + 9.0F * sigma_mps * sigma_mps) given_ = false;  // the robot left the given place
  if (headed_) return;
  if (n.inertial.starts_forward != 0 && speed2 > 1.0F && speed2 > 100.0F * sigma_mps * sigma_mps)
    return course(v_n_mps(0), v_n_mps(1), sigma_mps);
  monitor.find_by_velocity(v_n_mps, sigma_mps, n.gnss);
}

/// Without a receiver's velocity the robot goes where it points. Linearised about another direction, wheels would seem
/// to show the heading. Sideways the speed is uncertain by three times what the heading makes of it. The two are not
/// correlated here: the constraint would take the rest for knowledge of the heading.
inline Alignment::Start Alignment::start(const nav::InsState* before, const nav::LocalLevel& place,
                                         const HeadingMonitor& monitor, const param::InertialParameters& n,
                                         float forward_mps, base::Micros now) const {
  const bool again = before != nullptr;
  const bool rolls = !again && !monitor.has_velocity() && base::abs(forward_mps) < kFastest_mps;
  nav::InsState x = again ? *before : nav::InsState{};
  x.x = at_.x, x.y = at_.y, x.z = at_.z;
  // A heading found before is carried to the present by the gyroscope. Levelling knows the place's level axes only.
  const float turn = again ? base::wrap_angle(yaw_rad_ - nav::euler(before->q_nb).yaw_rad)
                           : base::wrap_angle(yaw_rad_ - place.convergence_rad() - level_yaw_rad_);
  const nav::Quaternion level = again ? before->q_nb : place.q_nl * levelling_.attitude();
  x.q_nb = (nav::exp_quaternion(turn * place.up_n) * level).renormalised();
  if (!again) x.v_n_mps = rolls ? x.q_nb.rotated_x() * forward_mps : v_n_mps_;
  const float sideways_mps = rolls ? 3.0F * sigma_yaw_rad_ * forward_mps : 0.0F;
  // A given pose has no speed.
  const bool unseen = !again && !monitor.has_velocity() && given_ && has_fixes_;
  const float own_mps = rolls ? kSlip_mps : unseen ? kUnseen_mps : sigma_v_mps_;
  const float speed = own_mps * own_mps + sideways_mps * sideways_mps;
  const float climb = sigma_climb_mps_ * sigma_climb_mps_;
  // A fix is true at its own stamp, and the robot went on since then; a given pose is that of now. The velocity of an
  // old fix is no way: then the place stays, and its variance holds the way.
  constexpr float kCarried_s = 5.0F;
  const float since_s = given_ || again || !has_fixes_ ? 0.0F : base::seconds(now - fixed_at_);
  const bool carried = since_s < kCarried_s;
  const float carried_s = carried ? since_s : 0.0F;
  nav::move(x.x, x.v_n_mps(0) * carried_s);
  nav::move(x.y, x.v_n_mps(1) * carried_s);
  nav::move(x.z, x.v_n_mps(2) * carried_s);
  const float since_s2 = since_s * since_s, way_m2 = carried ? 0.0F : x.v_n_mps.squaredNorm() * since_s2;
  const float h = at_.sigma_horizontal_m * at_.sigma_horizontal_m + speed * since_s2 + way_m2;
  const float v = at_.sigma_vertical_m * at_.sigma_vertical_m + climb * since_s2;
  const float tilt = n.start_tilt_rad * n.start_tilt_rad;
  const float a = n.accel_turn_on_mps2 * n.accel_turn_on_mps2, g = n.gyro_turn_on_radps * n.gyro_turn_on_radps;
  return {x, {h, h, v, speed, speed, climb, tilt, tilt, sigma_yaw_rad_ * sigma_yaw_rad_, a, a, a, g, g, g}};
}

}  // namespace tetap::estimators
