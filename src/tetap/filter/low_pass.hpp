// SPDX-License-Identifier: Apache-2.0
// Second-order Butterworth low-pass of N channels as a chain of two integrators: v'' = w^2 (x - v) - sqrt(2) w v'.
// Every sample is one semi-implicit Euler step. The interval enters as a factor, so it may differ from sample to
// sample.
#pragma once

#include "tetap/filter/quaternion.hpp"

namespace tetap::filter {

template <int N>
struct LowPass {
  Vector<float, N> value = Vector<float, N>::Zero();
  Vector<float, N> slope = Vector<float, N>::Zero();  ///< v' / w

  /// w dt for a cut-off w = sqrt(2)/tau, whose step response has the delay tau. Kept where the Euler step is stable: a
  /// signal sampled more slowly than its filter is smoothed over some samples instead.
  [[nodiscard]] static constexpr float factor(float tau_s, float dt_s) {
    const float k = 1.41421356F * dt_s / tau_s;
    return k < 0.5F ? k : 0.5F;
  }
  [[gnu::always_inline]] void step(const Vector<float, N>& x, float k) {
    const float rest = 1.0F - 1.41421356F * k;
    slope = rest * slope + k * (x - value);
    value += k * slope;
  }
  void start(const Vector<float, N>& x) { value = x, slope.setZero(); }
};

}  // namespace tetap::filter
