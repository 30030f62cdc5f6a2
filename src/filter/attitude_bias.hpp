// SPDX-License-Identifier: Apache-2.0
// Gyroscope bias, at rest and in motion. In motion a bias shows as the rate at which the accelerometer has to turn the
// attitude back; the gain follows from a Kalman filter of three states (the idea: Laidig & Seel 2023, sec. 3.5). Both
// sides of that comparison go through the accelerometer's low-pass, or the filter would count one error many times.
// Here: scalar updates instead of a matrix inverse, noise densities instead of a fixed sampling rate.
#pragma once

#include "filter/attitude_options.hpp"
#include "filter/low_pass.hpp"

namespace tetap::filter {

/// At rest: gyroscope and accelerometer have stayed near their own low-passed values for a while.
class RestDetector {
 public:
  void step(const AttitudeOptions& o, const Vector3& w_b_radps, const Vector3& f_b_mps2, float dt_s) {
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

  /// What the low-passed accelerometer was compared with, kept in step with it. k: the factor of its low-pass.
  void follow(const Rows& r, float k) {
    Vector<float, 8> now;
    now << r.x, r.y, dot(r.x, bias_), dot(r.y, bias_);
    lagged_.step(now, k);
  }
  /// The same while the accelerometer's low-pass is still an average that starts.
  void follow_average(const Rows& r, float share) {
    Vector<float, 8> now;
    now << r.x, r.y, dot(r.x, bias_), dot(r.y, bias_);
    lagged_.value += share * (now - lagged_.value);
  }

  void grow(float dt_s) {
    for (int i = 0; i < 3; ++i)
      if (p_(i, i) < most_) p_(i, i) += walk_ * dt_s;
  }
  /// In motion: the accelerometer turns the attitude at (x, y) about the horizontal axes of n.
  void correct_in_motion(const Rows& r, float x_radps, float y_radps, float dt_s) {
    const auto& l = lagged_.value;
    update({l(0), l(1), l(2)}, l(6) - x_radps, motion_, dt_s);
    update({l(3), l(4), l(5)}, l(7) - y_radps, motion_, dt_s);
    update(r.z, 0.0F, vertical_, dt_s);
  }
  void correct_at_rest(const Vector3& rate_b_radps, float dt_s) {
    update({1.0F, 0.0F, 0.0F}, rate_b_radps(0), rest_, dt_s);
    update({0.0F, 1.0F, 0.0F}, rate_b_radps(1), rest_, dt_s);
    update({0.0F, 0.0F, 1.0F}, rate_b_radps(2), rest_, dt_s);
  }

  [[nodiscard]] const Vector3& value() const { return bias_; }
  /// Of the axis known worst.
  [[nodiscard]] float sigma_radps() const { return base::sqrt(base::max(p_(0, 0), base::max(p_(1, 1), p_(2, 2)))); }

 private:
  static constexpr float square(float x) { return x * x; }
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
    bias_(0) = limited(bias_(0) + k(0) * innovation);
    bias_(1) = limited(bias_(1) + k(1) * innovation);
    bias_(2) = limited(bias_(2) + k(2) * innovation);
    p_(0, 0) = p00 - k(0) * ph(0);
    p_(0, 1) = p01 - k(0) * ph(1);
    p_(0, 2) = p02 - k(0) * ph(2);
    p_(1, 1) = p11 - k(1) * ph(1);
    p_(1, 2) = p12 - k(1) * ph(2);
    p_(2, 2) = p22 - k(2) * ph(2);
  }

  Vector3 bias_ = Vector3::Zero();
  Symmetric<float, 3> p_;
  LowPass<8> lagged_;  ///< first two rows of the rotation matrix, and their products with the bias taken off
  float most_, walk_, motion_, vertical_, rest_, limit_;
};

}  // namespace tetap::filter
