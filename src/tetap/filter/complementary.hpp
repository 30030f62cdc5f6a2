// SPDX-License-Identifier: Apache-2.0
// The complementary filter of one axis: what a rate knows of fast motion and what a slow sensor knows of the level. One
// time constant splits the two (Higgins 1975, IEEE Trans. Aerosp. Electron. Syst. 11(3); Mahony, Hamel, Pflimlin 2008).
// The high-pass is tau s/(tau s + 1), the low-pass 1/(tau s + 1), by backward differences: alpha = tau/(tau + dt).
#pragma once

#include "tetap/base/math.hpp"

namespace tetap::filter {

/// alpha = tau/(tau + dt) of a step; 0 (the slow sensor alone) unless both are positive numbers.
[[nodiscard]] constexpr float complementary_weight(float tau_s, float dt_s) {
  const float sum_s = tau_s + dt_s;
  return tau_s > 0.0F && dt_s > 0.0F && sum_s < base::kInfinity ? tau_s / sum_s : 0.0F;
}

namespace detail {
/// A number whose differences are numbers, and a weight.
[[nodiscard]] constexpr bool filterable(float x, float alpha) {
  return x < 1e30F && x > -1e30F && alpha >= 0.0F && alpha <= 1.0F;
}
}  // namespace detail

/// 1/(tau s + 1). The first sample is the start; what is no number changes nothing.
class FirstOrderLowPass {
 public:
  float step(float x, float alpha) {
    if (!detail::filterable(x, alpha)) return value_;
    value_ = started_ ? alpha * value_ + (1.0F - alpha) * x : x;
    started_ = true;
    return value_;
  }

 private:
  float value_ = 0.0F;
  bool started_ = false;
};

/// tau s/(tau s + 1): with the low-pass of the same weights it sums to the input.
class FirstOrderHighPass {
 public:
  float step(float x, float alpha) {
    if (!detail::filterable(x, alpha)) return value_;
    value_ = started_ ? alpha * (value_ + (x - last_)) : 0.0F;
    last_ = x;
    started_ = true;
    return value_;
  }

 private:
  float value_ = 0.0F, last_ = 0.0F;
  bool started_ = false;
};

/// angle = alpha (angle + rate dt) + (1 - alpha) measured, the difference taken the short way round.
class ComplementaryAngle {
 public:
  constexpr explicit ComplementaryAngle(float tau_s) : tau_s_(tau_s) {}

  /// False, and nothing changed, for what is no number or no positive time of at most a second.
  [[nodiscard]] constexpr bool step(float rate_radps, float measured_rad, float dt_s) {
    if (!base::is_finite(rate_radps) || !base::is_finite(measured_rad) || !(dt_s > 0.0F && dt_s <= 1.0F)) return false;
    if (base::abs(rate_radps) > kFastest_radps) return false;
    if (!started_) {
      angle_rad_ = base::wrap_angle(measured_rad);
      started_ = true;
      return true;
    }
    const float turned = base::wrap_angle(angle_rad_ + rate_radps * dt_s);
    const float innovation = base::wrap_angle(base::wrap_angle(measured_rad) - turned);
    angle_rad_ = base::wrap_angle(turned + (1.0F - complementary_weight(tau_s_, dt_s)) * innovation);
    return true;
  }
  [[nodiscard]] constexpr bool started() const { return started_; }
  [[nodiscard]] constexpr float angle_rad() const { return angle_rad_; }

 private:
  static constexpr float kFastest_radps = 1000.0F;
  float tau_s_;
  float angle_rad_ = 0.0F;
  bool started_ = false;
};

}  // namespace tetap::filter
