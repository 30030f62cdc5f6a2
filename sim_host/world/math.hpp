// SPDX-License-Identifier: Apache-2.0
// The world's arithmetic: only + - * / sqrt floor, which IEEE 754 makes exact, so that a seed gives the same bits on
// every host and with every C library. Power series (Abramowitz, Stegun 1964: 4.1.27, 4.2.1, 4.3.65, 4.3.66, 4.4.42)
// after reduction of the argument, to a few units in the last place; apart from src/base, because the world judges it.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace tetap::sim {

inline constexpr double kPi = 3.14159265358979323846;

/// Square root, rounding and scaling by powers of two are exact, whatever the library.
[[nodiscard]] inline double sqrt(double x) { return std::sqrt(x); }
[[nodiscard]] inline double floor(double x) { return std::floor(x); }
[[nodiscard]] constexpr double clamp(double x, double low, double high) { return x < low ? low : x > high ? high : x; }
[[nodiscard]] constexpr double magnitude(double x) { return x < 0 ? -x : x; }
[[nodiscard]] constexpr double radians(double degrees) { return degrees * (kPi / 180); }

inline constexpr std::array<double, 44> kOneOver = [] {
  std::array<double, 44> table{};
  for (std::size_t k = 1; k < table.size(); ++k) table[k] = 1.0 / static_cast<double>(k);
  return table;
}();

/// 1/n from a table, because the series would divide otherwise.
[[nodiscard]] constexpr double one_over(int n) { return kOneOver[static_cast<std::size_t>(n)]; }

struct Direction {
  double cos = 1;
  double sin = 0;
};

/// For |x| up to 1e6, which no angle of the world exceeds.
[[nodiscard]] inline Direction direction(double x) {
  // pi/2 in two parts, the first with 33 bits, so that its product with the number of quadrants is exact.
  constexpr double kHigh = 0x1.921FB544p+0;
  constexpr double kLow = 0x1.0B4611A626331p-34;
  const double quadrants = sim::floor(x * (2 / kPi) + 0.5);
  const double r = (x - quadrants * kHigh) - quadrants * kLow;
  const double r2 = r * r;
  double s = 1;
  for (int n = 16; n > 0; n -= 2) s = 1 - s * r2 * (one_over(n) * one_over(n + 1));
  double c = 1;
  for (int n = 15; n > 0; n -= 2) c = 1 - c * r2 * (one_over(n) * one_over(n + 1));
  s *= r;
  switch (static_cast<std::int64_t>(quadrants) & 3) {
    case 0:
      return {c, s};
    case 1:
      return {-s, c};
    case 2:
      return {-c, -s};
    default:
      return {s, -c};
  }
}
[[nodiscard]] inline double sin(double x) { return direction(x).sin; }
[[nodiscard]] inline double cos(double x) { return direction(x).cos; }

/// In [-pi, pi]; 0 for (0, 0).
[[nodiscard]] inline double atan2(double y, double x) {
  const double ay = magnitude(y);
  const double ax = magnitude(x);
  if (ax + ay <= 0) return 0;
  // The eighth of the circle nearest to the axis, then half of it again, so that the series runs over |t| <= tan(pi/8).
  const bool steep = ay > ax;
  double t = steep ? ax / ay : ay / ax;
  const bool turned = t > 0.41421356237309503;
  if (turned) t = (t - 1) / (t + 1);
  const double t2 = t * t;
  double sum = 0;
  for (int n = 43; n > 0; n -= 2) sum = one_over(n) - t2 * sum;
  double angle = t * sum + (turned ? kPi / 4 : 0);
  if (steep) angle = kPi / 2 - angle;
  if (x < 0) angle = kPi - angle;
  return y < 0 ? -angle : angle;
}

/// For |x| < 700.
[[nodiscard]] inline double exp(double x) {
  constexpr double kLn2High = 0x1.62E42FEEp-1;  // 32 bits, so that its product with the number of doublings is exact
  constexpr double kLn2Low = 0x1.A39EF35793C76p-33;
  const double doublings = sim::floor(x * (1 / 0.69314718055994531) + 0.5);
  const double r = (x - doublings * kLn2High) - doublings * kLn2Low;
  double sum = 1;
  for (int n = 14; n > 0; --n) sum = 1 + sum * r * one_over(n);
  return std::ldexp(sum, static_cast<int>(doublings));
}

/// For positive, normal x.
[[nodiscard]] inline double log(double x) {
  int doublings = 0;
  double m = std::frexp(x, &doublings);
  if (m < 0.70710678118654752) m *= 2, --doublings;
  const double t = (m - 1) / (m + 1);
  const double t2 = t * t;
  double sum = 0;
  for (int n = 23; n > 0; n -= 2) sum = one_over(n) + t2 * sum;
  return doublings * 0.69314718055994531 + 2 * t * sum;
}

/// Into [-pi, pi).
[[nodiscard]] inline double wrap(double angle_rad) {
  return angle_rad - 2 * kPi * sim::floor((angle_rad + kPi) / (2 * kPi));
}

}  // namespace tetap::sim
