// SPDX-License-Identifier: Apache-2.0
// Two-sided statistical bounds on NEES and NIS (Bar-Shalom, Li, Kirubarajan 2001, sec. 5.4).
#pragma once

#include <cmath>

namespace tetap::test {

/// The 95 % interval of the mean of `samples` independent chi-square variables of `degrees` freedom. The
/// Wilson-Hilferty cube is exact to 0.1 % for hundreds of degrees.
struct Interval {
  double low;
  double high;
  [[nodiscard]] bool has(double x) const { return x >= low && x <= high; }
};

[[nodiscard]] inline double chi_square_quantile(double normal_quantile, double degrees) {
  const double a = 2.0 / (9.0 * degrees);
  return degrees * std::pow(1.0 - a + normal_quantile * std::sqrt(a), 3.0);
}

[[nodiscard]] inline Interval mean_interval_95(int degrees, double samples) {
  const double n = degrees * samples;
  return {chi_square_quantile(-1.959964, n) / samples, chi_square_quantile(1.959964, n) / samples};
}

}  // namespace tetap::test
