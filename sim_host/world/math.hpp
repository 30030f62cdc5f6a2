// SPDX-License-Identifier: Apache-2.0
// The world's arithmetic: + - * / sqrt floor, which IEEE 754 makes exact, and src/tetap/base's functions in double. A
// seed gives the same bits on every host and with every C library.
#pragma once

#include "tetap/base/math.hpp"
#include "tetap/base/math_double.hpp"

#include <cmath>

namespace tetap::sim {

inline constexpr double kPi = 3.14159265358979323846;

struct Direction {
  double cos = 1;
  double sin = 0;
};

[[nodiscard]] inline Direction direction(double angle_rad) {
  const auto both = base::sincos(angle_rad);
  return {both.cos, both.sin};
}
[[nodiscard]] inline double sin(double x) { return base::sin(x); }
[[nodiscard]] inline double cos(double x) { return base::cos(x); }
[[nodiscard]] inline double atan2(double y, double x) { return base::atan2(y, x); }
[[nodiscard]] inline double exp(double x) { return base::exp(x); }
[[nodiscard]] inline double sqrt(double x) { return std::sqrt(x); }
[[nodiscard]] inline double floor(double x) { return std::floor(x); }

[[nodiscard]] constexpr double clamp(double x, double low, double high) { return x < low ? low : x > high ? high : x; }
[[nodiscard]] constexpr double magnitude(double x) { return x < 0 ? -x : x; }
[[nodiscard]] constexpr double radians(double degrees) { return degrees * (kPi / 180); }

/// Into [-pi, pi).
[[nodiscard]] inline double wrap(double angle_rad) {
  return angle_rad - 2 * kPi * sim::floor((angle_rad + kPi) / (2 * kPi));
}

}  // namespace tetap::sim
