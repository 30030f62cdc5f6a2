// SPDX-License-Identifier: Apache-2.0
// How inertial navigation begins: levels from gravity, then waits for a place and a heading: a given pose, an outside
// heading, a magnetometer's, or what the motion shows (nav/yaw_finder.hpp), forwards or in reverse. Of a robot that
// starts forwards for sure the course of GNSS is enough (fast velocity, or the chord between fixes). Where no wheels
// are heard, what finds a heading goes on beside the filter and judges its.
#pragma once

#include "checks/coloured_noise.hpp"
#include "checks/frozen_position.hpp"
#include "checks/offset_hypothesis.hpp"
#include "checks/position_drift.hpp"
#include "checks/startup_fix_check.hpp"
#include "model/gnss_course.hpp"
#include "model/gnss_fix_3d.hpp"
#include "model/planar_pose.hpp"
#include "nav/ins.hpp"
#include "nav/yaw_estimator.hpp"
#include "param/parameters.hpp"

namespace tetap::estimators {

class Alignment {
 public:
  /// An IMU sample before the filter runs; true once it is known where down is.
  bool level(const nav::ImuIncrement& imu, const param::InertialParameters& n) {
    const float dt_s = base::seconds(imu.dt);
    // The attitude so far turns with the gyroscope, and leans towards where the specific force says up is.
    turned_ = (turned_ * nav::exp_quaternion(imu.dtheta_b_rad)).renormalised();
    const nav::Vector3 up_n = turned_.rotate(imu.dv_b_mps);
    const float norm = base::sqrt(up_n.squaredNorm());
    if (norm < 3.0F * dt_s) return levelled_s_ >= n.level_s;
    const float memory_s = levelled_s_ < n.level_s ? levelled_s_ + dt_s : 5.0F * n.level_s;
    const nav::Vector3 lean = nav::cross(up_n / norm, nav::Vector3{0.0F, 0.0F, 1.0F});
    const float share = dt_s / memory_s;
    // Before the first sample anything may be up: the whole turn at once, then ever smaller shares of what is left.
    turned_ = (nav::exp_quaternion(levelled_s_ > 0.0F ? nav::Vector3(lean * share) : whole_turn(up_n / norm)) * turned_)
                  .renormalised();
    if (!(levelled_s_ > 0.0F)) level_yaw_rad_ = nav::euler(turned_).yaw_rad;
    const bool before = levelled_s_ >= n.level_s;
    levelled_s_ += dt_s;
    const bool level = levelled_s_ >= n.level_s;
    if (level && !before && !watches_) {
      finder_.restart(turned_);
    } else if (watches_ || (level && !headed_)) {
      static_cast<void>(finder_.predict(imu));
      if (level && !headed_ && finder_.ready()) heading(finder_.yaw_rad(), finder_.sigma_rad());
    }
    return level;
  }
  /// Increments are missing.
  void gap(base::Micros gap) {
    if (gap > base::Micros{100'000}) fixed_ = false;  // it may have turned: the way begins anew
    if (watches_ || (levelled_s_ > 0.0F && !headed_)) finder_.predict_without_imu(gap);
  }
  /// Beside a filter without wheels: what heading the motion shows is found once more, by nothing of the filter's.
  void watch(const nav::ImuIncrement& imu, const nav::Quaternion& q_nb) {
    if (!watches_) finder_.restart(q_nb);
    watches_ = true;
    static_cast<void>(finder_.predict(imu));
  }
  void watch(const model::GnssFix3d& fix) {
    if (watches_ && !has_velocity_)
      finder_.fuse_position(fix.x, fix.y, fix.sigma_horizontal_m, {fix.antenna_b_m(0), fix.antenna_b_m(1)});
  }
  void watch(const nav::Vector3& v_n_mps, float sigma_mps, const param::GnssParameters& n) {
    if (!watches_) return;
    has_velocity_ = true;
    finder_.fuse_velocity(v_n_mps(0), v_n_mps(1), sigma_mps, {n.antenna_x_b_m, n.antenna_y_b_m});
  }
  void watch_no_more() { watches_ = false; }
  [[nodiscard]] bool watches() const { return watches_; }
  /// By how many sigma a heading, that filter's or a magnetometer's, is another one; 0: it is not. What is less than
  /// half a radian off, velocities pull round.
  [[nodiscard, gnu::noinline]] float contradicts(float yaw_rad, float sigma_rad, float apart_rad = 0.5F,
                                                 float least = kSigmas) const {
    if (!watches_) return 0.0F;
    const float sigmas = finder_.against(yaw_rad, sigma_rad);
    const bool is = sigmas > least && finder_.apart_rad(yaw_rad) > apart_rad;
    return is ? sigmas : 0.0F;
  }
  static constexpr float kSigmas = 5;  ///< of what contradicts
  /// As another began: what the motion has shown of the heading stays.
  void take_over(const Alignment& from) {
    if (!from.watches_) return;
    finder_ = from.finder_;
    has_velocity_ = from.has_velocity_;
    watches_ = true;
  }
  /// Wheels: where it points it goes.
  void forward(float mps, float sigma_mps, float axle_x_b_m) {
    if (!headed_) finder_.fuse_forward_speed(mps, sigma_mps, {axle_x_b_m, 0.0F});
  }
  /// While the filter runs: what place() does not say stays as it is.
  void stay(const nav::InsState& x, float sigma_yaw_rad) {
    heading(nav::euler(x.q_nb).yaw_rad, sigma_yaw_rad);
    at_.z = x.z;
  }
  void place(const model::PlanarPose& pose, float sigma_m, float sigma_yaw_rad) {
    at_ = {.x = pose.x, .y = pose.y, .z = at_.z, .sigma_horizontal_m = sigma_m, .sigma_vertical_m = 10.0F};
    placed_ = given_ = true;
    if (is_heading(sigma_yaw_rad)) heading(pose.yaw_rad, sigma_yaw_rad);
  }
  /// Of a pose: else it says a place alone.
  static constexpr bool is_heading(float sigma_yaw_rad) { return sigma_yaw_rad < 1.0F; }
  void fix(const model::GnssFix3d& fix, base::Micros stamp, const param::Parameters& parameters) {
    const float dt_s = base::seconds(stamp - fixed_at_);
    if (fixed_ && !given_ && !has_velocity_ && dt_s > 0.01F && dt_s < 5.0F) {  // between the last two fixes
      v_n_mps_ = nav::Vector3{fix.x.minus(at_.x), fix.y.minus(at_.y), 0.0F} / dt_s;
      sigma_v_mps_ = 1.5F * fix.sigma_horizontal_m / dt_s + 2.0F;
      sigma_climb_mps_ = kUnseenClimb_mps;
    }
    fixed_at_ = stamp;
    const float yaw = nav::euler(turned_).yaw_rad, turned = base::wrap_angle(yaw - first_yaw_rad_);
    const bool arc_ends = base::abs(turned) > kArc_rad;
    bool far = false, near = true;
    if (parameters.inertial.starts_forward != 0 && fixed_ && !headed_) {
      const float east = fix.x.minus(first_x_), north = fix.y.minus(first_y_), gone2 = east * east + north * north;
      // Far beyond what two fixes of a robot that stands are ever apart, and twice, for it is asked at every fix. At
      // the end of an arc, a way that is shorter but long enough, too.
      const float share = arc_ends ? 0.25F : 1.0F;
      const float distance = share * parameters.gnss.align_distance_m, noise = 6.0F * fix.sigma_horizontal_m;
      const float needed = distance > noise ? distance : noise;
      far = gone2 > needed * needed && base::abs(turned) < 2.0F * kArc_rad;
      near = gone2 < 0.1F * noise * noise;
      way_s_ += dt_s;
      if (far && far_) {
        const float bias_rad = 0.5F * parameters.inertial.gyro_turn_on_radps * way_s_;
        course(east, north, 1.5F * fix.sigma_horizontal_m, turned, bias_rad);
      }
    }
    if (!headed_ && !has_velocity_ && !far)  // a fix as far as that is a course at the next, or an outlier
      finder_.fuse_position(fix.x, fix.y, fix.sigma_horizontal_m, {fix.antenna_b_m(0), fix.antenna_b_m(1)});
    const bool anew = !fixed_ || (arc_ends && far == far_);
    if (anew) first_x_ = fix.x, first_y_ = fix.y;
    // What the gyroscope shows before it has gone anywhere is its bias, or a turn on the spot: no arc.
    if (anew || near) first_yaw_rad_ = yaw, way_s_ = 0;
    far_ = far && !anew;
    fixed_ = heard_ = true;
    const float doubt = parameters.gnss.correlation_s > 0.0F ? checks::kStartPositionInflation : 1.0F;
    if (given_ && headed_ && at_.sigma_horizontal_m < fix.sigma_horizontal_m) {  // a pose from outside that is better
      at_.z = fix.z;
    } else {
      at_ = fix;
      at_.sigma_horizontal_m *= doubt;
      placed_ = true;
      given_ = false;
    }
    at_.sigma_vertical_m = doubt * fix.sigma_vertical_m;
  }
  /// Without has_climb its vertical part is none.
  void velocity(const nav::Vector3& v_n_mps, float sigma_mps, bool has_climb, const param::Parameters& n) {
    has_velocity_ = true;
    v_n_mps_ = v_n_mps;
    if (!has_climb) v_n_mps_(2) = 0.0F;
    sigma_v_mps_ = sigma_mps;
    sigma_climb_mps_ = has_climb ? sigma_mps : kUnseenClimb_mps;
    const float speed2 = v_n_mps(0) * v_n_mps(0) + v_n_mps(1) * v_n_mps(1);
    if (speed2 > 0.25F + 9.0F * sigma_mps * sigma_mps) given_ = false;  // it has gone from where it was said to be
    if (headed_) return;
    if (n.inertial.starts_forward != 0 && speed2 > 1.0F && speed2 > 100.0F * sigma_mps * sigma_mps)
      return course(v_n_mps(0), v_n_mps(1), sigma_mps);
    finder_.fuse_velocity(v_n_mps(0), v_n_mps(1), sigma_mps, {n.gnss.antenna_x_b_m, n.gnss.antenna_y_b_m});
  }
  void heading(float yaw_rad, float sigma_rad) {
    if (!base::is_finite(yaw_rad)) return;
    yaw_rad_ = yaw_rad;
    level_yaw_rad_ = nav::euler(turned_).yaw_rad;
    sigma_yaw_rad_ = sigma_rad;
    headed_ = true;
  }
  /// A field in level axes that should point to angle_rad from east; a heading found in another way is not given up.
  [[gnu::noinline]] void field(const nav::Vector3& field_n, float angle_rad, float sigma_rad) {
    if (headed_ && !(sigma_rad <= sigma_yaw_rad_)) return;
    const float turn = angle_rad - base::atan2(field_n(1), field_n(0));
    heading(base::wrap_angle(nav::euler(turned_).yaw_rad + turn), sigma_rad);
  }
  [[nodiscard]] const nav::Quaternion& attitude() const { return turned_; }
  [[nodiscard]] bool levelling() const { return levelled_s_ > 0.0F; }
  [[nodiscard]] bool placed() const { return placed_; }
  /// Fixes came before the filter began: later ones will tell how it moves.
  [[nodiscard]] bool hears_fixes() const { return heard_; }
  [[nodiscard]] bool ready() const { return placed_ && headed_; }

  /// Starts the filter; `again`: it ran before, so tilt and biases are its own. rolled_mps: forward, by wheels; NaN:
  /// none were heard.
  void begin(nav::Ins& ins, const param::InertialParameters& n, bool again, float rolled_mps = base::kNan) {
    // Without a receiver's velocity it goes where it points: linearised about another direction wheels would seem to
    // tell the heading.
    const bool rolls = !again && !has_velocity_ && base::abs(rolled_mps) < kFastest_mps;
    nav::InsState x = again ? ins.x : nav::InsState{};
    x.x = at_.x, x.y = at_.y, x.z = at_.z;
    const nav::Quaternion level = again ? ins.x.q_nb : turned_;
    // A heading found before is carried to the present by the gyroscope.
    const float turn = base::wrap_angle(yaw_rad_ - (again ? nav::euler(level).yaw_rad : level_yaw_rad_));
    x.q_nb = (nav::exp_quaternion({0.0F, 0.0F, turn}) * level).renormalised();
    if (!again) x.v_n_mps = rolls ? x.q_nb.rotated_x() * rolled_mps : v_n_mps_;
    const float h = at_.sigma_horizontal_m * at_.sigma_horizontal_m, v = at_.sigma_vertical_m * at_.sigma_vertical_m;
    // Wheels may slip. Sideways three times what the heading makes of the speed, for the two are not correlated here
    // and the constraint would take the rest for knowledge of the heading. A pose that was said says nothing of speed.
    const float sideways_mps = rolls ? 3.0F * sigma_yaw_rad_ * rolled_mps : 0.0F;
    const bool unseen = !again && !has_velocity_ && given_ && heard_;
    const float own_mps = rolls ? kSlip_mps : unseen ? kUnseen_mps : sigma_v_mps_;
    const float speed = own_mps * own_mps + sideways_mps * sideways_mps;
    const float climb = sigma_climb_mps_ * sigma_climb_mps_;
    const float tilt = n.start_tilt_rad * n.start_tilt_rad;
    const float a = n.accel_turn_on_mps2 * n.accel_turn_on_mps2, g = n.gyro_turn_on_radps * n.gyro_turn_on_radps;
    ins.start(x,
              std::array{h, h, v, speed, speed, climb, tilt, tilt, sigma_yaw_rad_ * sigma_yaw_rad_, a, a, a, g, g, g});
  }
  template <class Sink>
  void hash_state(Sink&& sink) const {
    sink(turned_.w);
    sink(turned_.x);
    sink(turned_.y);
    sink(turned_.z);
    sink(levelled_s_);
    sink(at_.x.um());
    sink(at_.y.um());
    for (const float v : {yaw_rad_, level_yaw_rad_, sigma_yaw_rad_, sigma_v_mps_, sigma_climb_mps_}) sink(v);
    for (int i = 0; i < 3; ++i) sink(v_n_mps_(i));
    sink(first_x_.um());
    sink(first_y_.um());
    sink(first_yaw_rad_);
    sink(way_s_);
    sink(at_.z.um());
    sink(at_.sigma_horizontal_m);
    sink(at_.sigma_vertical_m);
    sink(fixed_at_.us);
    finder_.hash_state(sink);
    sink(static_cast<std::uint32_t>((placed_ ? 1U : 0U) | (headed_ ? 2U : 0U) | (fixed_ ? 4U : 0U) |
                                    (given_ ? 8U : 0U) | (has_velocity_ ? 16U : 0U) | (watches_ ? 32U : 0U) |
                                    (heard_ ? 64U : 0U) | (far_ ? 128U : 0U)));
  }

 private:
  /// The turn that brings a unit vector upright; upside down it goes over x.
  static nav::Vector3 whole_turn(const nav::Vector3& up) {
    const nav::Vector3 axis = nav::cross(up, nav::Vector3{0.0F, 0.0F, 1.0F});
    const float s = base::sqrt(axis.squaredNorm());
    if (s < 1e-3F) return up(2) > 0.0F ? nav::Vector3(nav::Vector3::Zero()) : nav::Vector3{3.14159265F, 0.0F, 0.0F};
    return axis * (base::atan2(s, up(2)) / s);
  }
  /// Forward is the way it goes, or went: of an arc the chord points where the middle did.
  void course(float east, float north, float sigma, float turned_rad = 0.0F, float bias_rad = 0.0F) {
    const float length = base::sqrt(east * east + north * north);  // of a velocity, or of a way
    constexpr float kSlip_rad = 0.1F;                              // a crab's walk
    const float uneven_rad = 0.25F * turned_rad;                   // not all of a way is an arc
    const model::GnssCourse course(east / length, north / length, sigma / length,
                                   base::sqrt(kSlip_rad * kSlip_rad + uneven_rad * uneven_rad + bias_rad * bias_rad));
    heading(base::wrap_angle(course.angle_rad + 0.5F * turned_rad), course.sigma_rad);
  }

  static constexpr float kArc_rad = 0.5F;     ///< of a way that turns more the chord is no course
  static constexpr float kFastest_mps = 200;  ///< no wheels roll faster: a reading that is broken
  static constexpr float kSlip_mps = 3;       ///< 1 sigma of wheels that slip or were read a second ago
  static constexpr float kUnseen_mps = 15, kUnseenClimb_mps = 5;  ///< 1 sigma of what nothing was heard

  nav::Quaternion turned_;
  model::GnssFix3d at_;
  base::Micros fixed_at_;
  nav::YawEstimator finder_;
  base::Anchored first_x_, first_y_;     ///< where the way begins whose chord is the course,
  float first_yaw_rad_ = 0, way_s_ = 0;  ///< how it looked there, and how long ago that was
  nav::Vector3 v_n_mps_ = nav::Vector3::Zero();
  float sigma_v_mps_ = 3, sigma_climb_mps_ = 3;
  float levelled_s_ = 0;
  float yaw_rad_ = 0, level_yaw_rad_ = 0, sigma_yaw_rad_ = 3;  ///< the second: of turned_, when the first was found
  bool placed_ = false, headed_ = false, fixed_ = false, has_velocity_ = false;
  bool heard_ = false;    ///< fixes were
  bool watches_ = false;  ///< it runs beside the filter, or did
  bool given_ = false;    ///< where it is was said, not found
  bool far_ = false;      ///< the last fix was as far as a course needs
};

}  // namespace tetap::estimators
