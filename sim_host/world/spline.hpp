// SPDX-License-Identifier: Apache-2.0
// A uniform B-spline of degree five: a curve with four continuous derivatives and all of them in closed form. Source:
// de Boor, A Practical Guide to Splines, 1978, ch. IX. The matrix of the basis: Qin, The Visual Computer 16, 2000,
// sec. 4.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

namespace tetap::sim {

/// One interval of it, with six control values; the next interval begins with the next control value.
class QuinticSpline {
 public:
  struct Value {
    double x = 0, rate = 0, acceleration = 0;
  };

  QuinticSpline(double start, double interval_s) : per_s_{1 / interval_s} { controls_.fill(start); }

  void push(double control) {
    std::rotate(controls_.begin(), controls_.begin() + 1, controls_.end());
    controls_.back() = control;
    expand();
  }
  /// `map` is affine: the curve goes with its control values.
  template <class Map>
  void move(Map&& map) {
    for (std::size_t i = 0; i < controls_.size(); ++i) controls_[i] = map(controls_[i], i);
    expand();
  }
  [[nodiscard]] double control(std::size_t i) const { return controls_[i]; }

  /// `u` in [0, 1] of the interval.
  [[nodiscard]] Value at(double u) const {
    const auto& a = a_;
    const double x = ((((a[5] * u + a[4]) * u + a[3]) * u + a[2]) * u + a[1]) * u + a[0];
    const double rate = (((5 * a[5] * u + 4 * a[4]) * u + 3 * a[3]) * u + 2 * a[2]) * u + a[1];
    const double acceleration = ((20 * a[5] * u + 12 * a[4]) * u + 6 * a[3]) * u + 2 * a[2];
    return {controls_[2] + x, rate * per_s_, acceleration * (per_s_ * per_s_)};
  }

 private:
  /// Differences from one of the controls, and with them exactly 0 where all are equal.
  void expand() {
    std::array<double, 6> e;
    for (std::size_t i = 0; i < 6; ++i) e[i] = (controls_[i] - controls_[2]) / 120;
    a_ = {e[0] + 26 * e[1] + 26 * e[3] + e[4],           -5 * e[0] - 50 * e[1] + 50 * e[3] + 5 * e[4],
          10 * e[0] + 20 * e[1] + 20 * e[3] + 10 * e[4], -10 * e[0] + 20 * e[1] - 20 * e[3] + 10 * e[4],
          5 * e[0] - 20 * e[1] - 20 * e[3] + 5 * e[4],   -e[0] + 5 * e[1] + 10 * e[3] - 5 * e[4] + e[5]};
  }

  double per_s_;
  std::array<double, 6> controls_;
  std::array<double, 6> a_{};  ///< coefficients of the powers of u
};

}  // namespace tetap::sim
