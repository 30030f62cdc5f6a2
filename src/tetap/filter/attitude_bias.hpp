// SPDX-License-Identifier: Apache-2.0
// Gyroscope bias, at rest and in motion. In motion a bias shows as the rate at which the accelerometer has to turn the
// attitude back. The gain follows from a Kalman filter of three states (the idea: Laidig & Seel 2023, sec. 3.5). Both
// sides of that comparison go through the accelerometer's low-pass. Otherwise the filter would count one error many
// times. Here: scalar updates instead of a matrix inverse, noise densities instead of a fixed sampling rate.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/filter/attitude_options.hpp"
#include "tetap/filter/low_pass.hpp"

namespace tetap::filter {

/// At rest: gyroscope and accelerometer have stayed near their own low-passed values for a while.
class RestDetector {
 public:
  [[gnu::always_inline]] inline void step(const AttitudeOptions& o, const Vector3& w_b_radps, const Vector3& f_b_mps2,
                                          float dt_s) {
    if (!started_) rate_.start(w_b_radps), force_.start(f_b_mps2), started_ = true;
    const float k = LowPass<3>::factor(o.tau_rest_s, dt_s);
    rate_.step(w_b_radps, k);
    force_.step(f_b_mps2, k);
    const bool still = within(w_b_radps - rate_.value, o.rest_rate_radps) &&
                       within(f_b_mps2 - force_.value, o.rest_acceleration_mps2) &&
                       within(rate_.value, 1.7320508F * o.bias_limit_radps);
    still_s_ = !still ? 0.0F : still_s_ < o.rest_after_s ? still_s_ + dt_s : still_s_;
    at_rest_ = still_s_ >= o.rest_after_s;
  }
  [[nodiscard]] bool at_rest() const { return at_rest_; }
  [[nodiscard]] const Vector3& rate_b_radps() const { return rate_.value; }  ///< low-passed
  static constexpr auto members(auto& self) {
    return base::members(base::in_turns(self.rate_), base::in_turns(self.force_), base::in_turns(self.still_s_),
                         self.started_, self.at_rest_);
  }

 private:
  LowPass<3> rate_, force_;
  float still_s_ = 0.0F;
  bool started_ = false, at_rest_ = false;
};

class GyroscopeBias {
 public:
  explicit GyroscopeBias(const AttitudeOptions& o)
      : p_(Symmetric<float, 3>::diagonal(
            {square(o.bias_start_sigma_radps), square(o.bias_start_sigma_radps), square(o.bias_start_sigma_radps)})),
        most_(square(o.bias_start_sigma_radps)),
        walk_(square(o.bias_walk_radps) / o.bias_walk_s),
        motion_(square(square(o.bias_motion_sigma_radps)) / walk_),
        vertical_(motion_ / o.bias_vertical_weight),
        rest_(square(square(o.bias_rest_sigma_radps)) / walk_),
        limit_(o.bias_limit_radps) {}

  /// Levelling of one step: turn of the attitude about the horizontal axes of n.
  struct Levelling {
    float x_rad, y_rad;
    float tau_s;  ///< time constant of the accelerometer's low-pass
    bool usable;  ///< settled, and neither limited nor held
  };

  /// A fifth of the work per step, in turns, each as if for five steps: what is compared is low-passed over seconds.
  [[gnu::always_inline]] inline void step(const Rows& r, const Levelling& levelling, const RestDetector& rest,
                                          float dt_s) {
    phase_ = phase_ < 4 ? phase_ + 1 : 0;
    const float span_s = 5.0F * dt_s;
    if (phase_ == 0) bias_ = {limited(bias_(0)), limited(bias_(1)), limited(bias_(2))};
    if (phase_ == 0) return x_.follow(r.x, bias_, levelling.tau_s, span_s);
    if (phase_ == 1) return y_.follow(r.y, bias_, levelling.tau_s, span_s);
    if (phase_ == 2) grow(span_s);
    const int axis = phase_ - 2;
    if (rest.at_rest()) {
      const Vector3 h{axis == 0 ? 1.0F : 0.0F, axis == 1 ? 1.0F : 0.0F, axis == 2 ? 1.0F : 0.0F};
      update(h, rest.rate_b_radps()(axis), rest_, span_s);
    } else if (levelling.usable && axis == 2) {
      update(r.z, 0.0F, vertical_, span_s);
    } else if (levelling.usable) {
      const Lagged& lagged = axis == 0 ? x_ : y_;
      update(lagged.row(), lagged.along() - (axis == 0 ? levelling.x_rad : levelling.y_rad) / dt_s, motion_, span_s);
    }
  }

  [[nodiscard]] const Vector3& value() const { return bias_; }
  /// 1 sigma of the axis known worst.
  [[nodiscard]] float sigma_radps() const { return base::sqrt(base::max(p_(0, 0), base::max(p_(1, 1), p_(2, 2)))); }
  static constexpr auto members(auto& self) {
    return base::members(self.bias_, self.p_, base::in_turns(self.x_), base::in_turns(self.y_),
                         base::in_turns(self.most_), base::in_turns(self.walk_), base::in_turns(self.motion_),
                         base::in_turns(self.vertical_), base::in_turns(self.rest_), base::in_turns(self.limit_),
                         self.phase_);
  }

 private:
  static constexpr float square(float x) { return x * x; }
  /// A row of the rotation matrix, and its product with the bias taken off, kept in step with the accelerometer.
  struct Lagged {
    LowPass<4> low_pass;

    void follow(const Vector3& r, const Vector3& bias, float tau_s, float span_s) {
      low_pass.step({r(0), r(1), r(2), dot(r, bias)}, LowPass<4>::factor(tau_s, span_s));
    }
    [[nodiscard]] Vector3 row() const { return {low_pass.value(0), low_pass.value(1), low_pass.value(2)}; }
    [[nodiscard]] float along() const { return low_pass.value(3); }
  };
  void grow(float dt_s) {
    for (int i = 0; i < 3; ++i)
      if (p_(i, i) < most_) p_(i, i) += walk_ * dt_s;
  }
  [[nodiscard]] float limited(float x) const { return x > limit_ ? limit_ : x < -limit_ ? -limit_ : x; }

  /// z = h . bias + noise of the given density: variance density/dt over a step. A scalar Kalman update; the steady
  /// state of one axis is sigma^2 = sqrt(density walk), which is how the densities follow from the options.
  void update(const Vector3& h, float z, float density, float dt_s) {
    const float p00 = p_(0, 0), p01 = p_(0, 1), p02 = p_(0, 2), p11 = p_(1, 1), p12 = p_(1, 2), p22 = p_(2, 2);
    const Vector3 ph{p00 * h(0) + p01 * h(1) + p02 * h(2), p01 * h(0) + p11 * h(1) + p12 * h(2),
                     p02 * h(0) + p12 * h(1) + p22 * h(2)};
    const float gain = dt_s / (density + dt_s * dot(h, ph));
    const Vector3 k = gain * ph;
    const float innovation = limited(z - dot(h, bias_));
    bias_ += innovation * k;
    p_(0, 0) = p00 - k(0) * ph(0);
    p_(0, 1) = p01 - k(0) * ph(1);
    p_(0, 2) = p02 - k(0) * ph(2);
    p_(1, 1) = p11 - k(1) * ph(1);
    p_(1, 2) = p12 - k(1) * ph(2);
    p_(2, 2) = p22 - k(2) * ph(2);
  }

  Vector3 bias_ = Vector3::Zero();
  Symmetric<float, 3> p_;
  Lagged x_, y_;
  float most_, walk_, motion_, vertical_, rest_, limit_;
  int phase_ = 4;  ///< the first steps fill x_ and y_
};

}  // namespace tetap::filter
