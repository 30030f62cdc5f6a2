// SPDX-License-Identifier: Apache-2.0
// Attitude from gyroscope, accelerometer and, where there is one, magnetometer: a complementary filter whose slow part
// is a low-pass of the accelerometer in axes that hardly turn, so that motion averages out before it counts
// (Laidig & Seel 2023, Information Fusion 91; measured facts and equations, own design). The gyroscope turns q_lb; the
// low-passed accelerometer, carried in the level axes l, turns it back to level; heading is a separate angle from l to
// n (east, north, up); the bias is estimated beside. Time is an argument; every sample may have its own interval.
#pragma once

#include "filter/attitude_bias.hpp"
#include "filter/attitude_heading.hpp"

#include <cstdint>

namespace tetap::filter {

enum class AttitudeVerdict : std::uint8_t { kAccepted, kAccelerometerRefused, kRefused };

class Attitude {
 public:
  Attitude() : Attitude(AttitudeOptions{}) {}
  explicit Attitude(const AttitudeOptions& options) : o_(options), bias_(options), heading_(options) {}

  /// A sample of both that were constant over the last dt_s. kRefused: no numbers, or no time, and nothing has changed;
  /// kAccelerometerRefused: clipped (`force_usable` false stands for that in a mean that hides it) or in free fall, the
  /// gyroscope alone was used.
  [[nodiscard]] AttitudeVerdict step(const Vector3& w_b_radps, const Vector3& f_b_mps2, float dt_s,
                                     bool force_usable = true) {
    const float w2 = dot(w_b_radps, w_b_radps);
    const float f2 = dot(f_b_mps2, f_b_mps2);
    if (!(dt_s >= kShortest_s && dt_s <= kLongest_s && w2 <= kFastest_radps * kFastest_radps && f2 < base::kInfinity))
      return AttitudeVerdict::kRefused;
    const float most = o_.accelerometer_limit_mps2;
    const bool usable = force_usable && f2 > kLeastForce_mps2 * kLeastForce_mps2 && f2 < most * most;
    if (!started_) {
      if (!usable) return AttitudeVerdict::kRefused;
      q_lb_ = levelled(f_b_mps2);
      started_ = true;
    } else {
      q_lb_ = turned(q_lb_, (0.5F * dt_s) * (w_b_radps - bias_.value()));
      const float clip = o_.gyroscope_limit_radps;
      if (w2 > clip * clip && !inside(w_b_radps, clip)) turn_lost();
    }
    rest_.step(o_, w_b_radps, f_b_mps2, dt_s);
    if (!usable) return AttitudeVerdict::kAccelerometerRefused;
    level(f_b_mps2, dt_s);
    return AttitudeVerdict::kAccepted;
  }

  /// The magnetometer's sample of the last step's time, in any unit; dt_s since the one before. False if no direction.
  bool magnetometer(const Vector3& m_b, float dt_s) {
    const float m2 = dot(m_b, m_b);
    if (!started_ || !(m2 > 0.0F && m2 < kStrongest2) || !(dt_s > 0.0F)) return false;
    if (off_ && heading_.known()) return true;  // a heading would only be as good as the level
    const bool turning = !within(rest_.rate_b_radps(), o_.field_motion_radps);
    heading_.step(o_, Rows(q_lb_) * m_b, turning, dt_s < 1.0F ? dt_s : 1.0F);
    return true;
  }

  /// The turn of the last moments is lost: the slow sensors set the attitude again, by a mean that begins here.
  void turn_lost() {
    age_s_ = o_.relevel_s;
    heading_.average_anew(o_.relevel_s);
  }

  [[nodiscard]] bool started() const { return started_; }
  /// Turns b into n: z is up; with a heading x is east, without one the heading is free and drifts with the bias.
  [[nodiscard]] Quaternion q_nb() const { return heading_.turned(q_lb_); }
  [[nodiscard]] const Vector3& bias_b_radps() const { return bias_.value(); }
  [[nodiscard]] float bias_sigma_radps() const { return bias_.sigma_radps(); }
  [[nodiscard]] bool at_rest() const { return rest_.at_rest(); }
  [[nodiscard]] bool heading_known() const { return heading_.known(); }
  [[nodiscard]] bool magnetometer_disturbed() const { return heading_.disturbed(); }
  [[nodiscard]] float magnetometer_disturbed_s() const { return heading_.disturbed_s(); }
  [[nodiscard]] bool accelerometer_disturbed() const { return off_; }

 private:
  static constexpr float kShortest_s = 1e-6F, kLongest_s = 0.2F, kFastest_radps = 100.0F, kLeastForce_mps2 = 0.1F;
  static constexpr float kStrongest2 = 1e30F;  ///< in any unit; the squares of what is made of it are numbers

  [[nodiscard]] static bool inside(const Vector3& v, float limit) {
    return base::abs(v(0)) < limit && base::abs(v(1)) < limit && base::abs(v(2)) < limit;
  }

  [[gnu::always_inline]] inline void level(const Vector3& f_b, float dt_s) {
    const Rows r(q_lb_);
    const Vector3 f_l = r * f_b;
    float share = 0.0F;
    if (age_s_ < o_.tau_inclination_s) {
      // A mean over what there is, the last samples counting most: the first second is as good as its samples.
      age_s_ += dt_s;
      share = age_s_ > 2.0F * dt_s ? 2.0F * dt_s / age_s_ : 1.0F;
      up_.value += share * (f_l - up_.value);
    } else {
      up_.step(f_l, LowPass<3>::factor(o_.tau_inclination_s, dt_s));
    }
    const float n2 = dot(up_.value, up_.value);
    if (!(n2 > kLeastForce_mps2 * kLeastForce_mps2)) return;
    // The turn about a horizontal axis that brings it upright: for small angles the cross product with the vertical.
    const float scale = 1.0F / base::sqrt(n2);
    float x = scale * up_.value(1);
    float y = -scale * up_.value(0);
    const float tilt2 = x * x + y * y;
    const float most = share > 0.0F ? 1.0F : o_.inclination_limit_radps * dt_s;
    off_ = tilt2 > most * most;
    if (off_ && held_s_ < o_.inclination_hold_s) {
      held_s_ += dt_s;
      const bool far = tilt2 > o_.inclination_reject_rad * o_.inclination_reject_rad;
      const float cut = far ? 0.0F : most / base::sqrt(tilt2);
      x *= cut;
      y *= cut;
    } else if (!off_) {
      held_s_ = held_s_ > dt_s ? held_s_ - dt_s : 0.0F;
    }
    // Corrections at the start and after a disturbance are not the bias.
    calm_s_ = off_ || share > 0.0F ? 0.0F : calm_s_ < o_.tau_inclination_s ? calm_s_ + dt_s : calm_s_;
    bias_.step(o_, r, {.x_rad = x, .y_rad = y, .usable = calm_s_ >= o_.tau_inclination_s, .average_share = share},
               rest_, dt_s);
    turn_level(x, y);
  }

  /// Turns the level axes by (x, y, 0): q and what is carried in them.
  [[gnu::always_inline]] inline void turn_level(float x, float y) {
    const Quaternion q = q_lb_;
    const float hx = 0.5F * x, hy = 0.5F * y;
    const Quaternion next{q.w - (hx * q.x + hy * q.y), q.x + (hx * q.w + hy * q.z), q.y + (hy * q.w - hx * q.z),
                          q.z + (hx * q.y - hy * q.x)};
    q_lb_ = hx * hx + hy * hy < 2.5e-3F ? next.renormalised() : next.normalised();  // Newton's step near 1
    const auto tilt = [x, y](Vector3& v) {
      v = Vector3{v(0) + y * v(2), v(1) - x * v(2), v(2) + (x * v(1) - y * v(0))};
    };
    tilt(up_.value);
    tilt(up_.slope);
  }

  AttitudeOptions o_;
  Quaternion q_lb_{};
  LowPass<3> up_;
  RestDetector rest_;
  GyroscopeBias bias_;
  MagneticHeading heading_;
  float age_s_ = 0.0F, held_s_ = 0.0F, calm_s_ = 0.0F;
  bool started_ = false, off_ = false;
};

}  // namespace tetap::filter
