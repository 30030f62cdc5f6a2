// SPDX-License-Identifier: Apache-2.0
// Attitude from gyroscope, accelerometer and, on a body that has one, magnetometer, by a complementary filter. Its slow
// part is a low-pass of the accelerometer in axes that hardly turn: motion averages out before it counts. Source:
// Laidig & Seel 2023, Information Fusion 91, sec. 3; equations, own design. The gyroscope turns q_lb. The low-passed
// accelerometer, carried in the level axes l, turns it back to level. Heading is a separate angle from l to n (east,
// north, up). The bias is estimated beside. Time is an argument; every sample may have its own interval.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/filter/attitude_bias.hpp"
#include "tetap/filter/attitude_clipping.hpp"
#include "tetap/filter/attitude_heading.hpp"

#include <cstdint>

namespace tetap::filter {

enum class AttitudeVerdict : std::uint8_t { kAccepted, kAccelerometerRefused, kRefused };

/// Clipping that a driver has seen within the interval of a sample, where the mean hides it.
struct ClippedSensors {
  bool gyroscope = false, accelerometer = false;
};

class Attitude {
 public:
  Attitude() : Attitude(AttitudeOptions{}) {}
  [[gnu::cold]] explicit Attitude(const AttitudeOptions& options, const SensorRange& range = {})
      : o_(options),
        strongest_mps2_(SensorRange::kRangeShare * range.accelerometer_mps2),
        clipping_(range.gyroscope_radps),
        bias_(options),
        heading_(options) {}

  /// Another full scale of the sensors, for the samples from now on.
  void set_range(const SensorRange& range) {
    strongest_mps2_ = SensorRange::kRangeShare * range.accelerometer_mps2;
    clipping_.set_range(range.gyroscope_radps);
  }

  /// A sample of both that were constant over the last dt_s. Without numbers or time the verdict is kRefused, and
  /// nothing has changed. A clipped sample, or free fall, gives kAccelerometerRefused: the gyroscope alone was used.
  [[nodiscard]] AttitudeVerdict step(const Vector3& w_b_radps, const Vector3& f_b_mps2, float dt_s,
                                     ClippedSensors clipped = {}) {
    const float w2 = dot(w_b_radps, w_b_radps);
    const float f2 = dot(f_b_mps2, f_b_mps2);
    if (!(dt_s >= kShortest_s && dt_s <= kLongest_s && w2 <= kFastest_radps * kFastest_radps && f2 < base::kInfinity))
      return AttitudeVerdict::kRefused;
    const bool usable =
        !clipped.accelerometer && f2 > kLeastForce_mps2 * kLeastForce_mps2 && f2 < strongest_mps2_ * strongest_mps2_;
    if (!started_) {
      if (!usable) return AttitudeVerdict::kRefused;
      q_lb_ = levelled(f_b_mps2);
      up_.start(Rows(q_lb_) * f_b_mps2);
      started_ = true;
    } else {
      q_lb_ = turned(q_lb_, (0.5F * dt_s) * (w_b_radps - bias_.value()));
    }
    if (ClippedTurn::Missed missed; clipping_.step(w_b_radps, w2, clipped.gyroscope, dt_s, missed)) bridge(missed);
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
    const Vector3 rate = clipping_.rate_b_radps() - bias_.value();
    const float unsettled = tau_s_ < o_.tau_inclination_s ? o_.tau_inclination_s / tau_s_ : 1.0F;
    heading_.step(Rows(q_lb_) * m_b, base::sqrt(dot(rate, rate)), unsettled * unsettled, dt_s < 1.0F ? dt_s : 1.0F);
    return true;
  }

  /// The gyroscope missed a turn of up to this angle. The speed of a body is bounded. A mean over T seconds of the
  /// accelerometer is wrong by the change of speed over g T. An error of n times the settled one asks for 1/n of the
  /// time.
  void lose(float turn_rad) {
    const float sigmas = turn_rad / o_.inclination_sigma_rad;
    tau_s_ /= 1.0F + sigmas;
    heading_.lose(sigmas);
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
  static constexpr auto members(auto& self) {
    return base::members(base::in_turns(self.o_), base::in_turns(self.strongest_mps2_), self.q_lb_, self.up_,
                         self.clipping_, self.rest_, self.bias_, self.heading_, self.tau_s_, self.held_s_, self.calm_s_,
                         self.started_, self.off_);
  }

 private:
  static constexpr float kShortest_s = 1e-6F, kLongest_s = 0.2F, kFastest_radps = 100.0F, kLeastForce_mps2 = 0.1F;
  static constexpr float kStrongest2 = 1e30F;  ///< in any unit; the squares of what is made of it are numbers

  /// Growth of the time constant while the low-pass settles: an error at the start then falls with t^-2.
  static constexpr float kSettling = 0.4F;

  /// Adds a turn that the gyroscope has not shown; it is as uncertain as it is large.
  [[gnu::noinline]] void bridge(const ClippedTurn::Missed& missed) {
    const Vector3& turn = missed.turn_b_rad;
    const float angle = base::sqrt(dot(turn, turn));
    if (angle > 0.0F) {
      const base::SinCos half = base::sincos(0.5F * angle);
      const Vector3 axis = (half.sin / angle) * turn;
      q_lb_ = (q_lb_ * Quaternion{half.cos, axis(0), axis(1), axis(2)}).normalised();
    }
    lose(missed.sigma_rad);
  }

  [[gnu::always_inline]] inline void level(const Vector3& f_b, float dt_s) {
    const Rows r(q_lb_);
    const Vector3 f_l = r * f_b;
    const bool settling = tau_s_ < o_.tau_inclination_s;
    if (settling) tau_s_ += kSettling * dt_s;
    const float tau_s = settling ? tau_s_ : o_.tau_inclination_s;
    up_.step(f_l, LowPass<3>::factor(tau_s, dt_s));
    const float n2 = dot(up_.value, up_.value);
    if (!(n2 > kLeastForce_mps2 * kLeastForce_mps2)) return;
    // The turn about a horizontal axis that brings it upright: for small angles the cross product with the vertical.
    const float scale = 1.0F / base::sqrt(n2);
    float x = scale * up_.value(1);
    float y = -scale * up_.value(0);
    const float tilt2 = x * x + y * y;
    const float most = settling ? 1.0F : o_.inclination_limit_radps * dt_s;
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
    // The turn back at the start and after a disturbance is not the bias.
    calm_s_ = off_ || settling ? 0.0F : calm_s_ < o_.tau_inclination_s ? calm_s_ + dt_s : calm_s_;
    bias_.step(r, {.x_rad = x, .y_rad = y, .tau_s = tau_s, .usable = calm_s_ >= o_.tau_inclination_s}, rest_, dt_s);
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
  float strongest_mps2_;
  Quaternion q_lb_{};
  LowPass<3> up_;
  ClippedTurn clipping_;
  RestDetector rest_;
  GyroscopeBias bias_;
  MagneticHeading heading_;
  float tau_s_ = 0.0F;  ///< time constant of the low-pass while it settles
  float held_s_ = 0.0F, calm_s_ = 0.0F;
  bool started_ = false, off_ = false;
};

}  // namespace tetap::filter
