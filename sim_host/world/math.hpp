// SPDX-License-Identifier: Apache-2.0
// The world's arithmetic: everything beyond + - * / sqrt goes through here, so that a seed gives the same bits on every
// host.
#pragma once

#include <cmath>

namespace tetap::sim {

inline constexpr double kPi = 3.14159265358979323846;

struct Direction {
  double cos = 1;
  double sin = 0;
};

[[nodiscard]] inline double sin(double x) { return std::sin(x); }
[[nodiscard]] inline double cos(double x) { return std::cos(x); }
[[nodiscard]] inline double atan2(double y, double x) { return std::atan2(y, x); }
[[nodiscard]] inline double exp(double x) { return std::exp(x); }
[[nodiscard]] inline double log(double x) { return std::log(x); }
/// Square root and rounding are exact by IEEE 754, whatever the library.
[[nodiscard]] inline double sqrt(double x) { return std::sqrt(x); }
[[nodiscard]] inline double floor(double x) { return std::floor(x); }

[[nodiscard]] inline Direction direction(double angle_rad) { return {sim::cos(angle_rad), sim::sin(angle_rad)}; }

/// Into [-pi, pi).
[[nodiscard]] inline double wrap(double angle_rad) {
  return angle_rad - 2 * kPi * sim::floor((angle_rad + kPi) / (2 * kPi));
}

[[nodiscard]] constexpr double clamp(double x, double low, double high) { return x < low ? low : x > high ? high : x; }
[[nodiscard]] constexpr double magnitude(double x) { return x < 0 ? -x : x; }
[[nodiscard]] constexpr double radians(double degrees) { return degrees * (kPi / 180); }

}  // namespace tetap::sim
