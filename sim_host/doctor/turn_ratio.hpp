// SPDX-License-Identifier: Apache-2.0
// The yaw rate of the gyroscope over that of another device. Noise of one makes the slope too small, noise of the other
// too large: the two regressions enclose the factor.
#pragma once

#include "sim_host/doctor/codes.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

namespace tetap::doctor {

struct TurnRatio {
  const char* device = "";
  Devices uses = kNoDevice;
  double low = 0, high = 0;  ///< bounds of the factor's magnitude
  double correlation = 0;    ///< negative: the two turn against each other
  double seconds = 0;        ///< time of the pairs; of windows of a second it is their number

  [[nodiscard]] double value() const { return std::sqrt(low * high); }
};

/// From the variances of gyroscope and reference and their covariance (one unit squared, as rad^2/s^2) over `pairs`.
/// Nothing where the correlation is below the least, or where two standard errors are as large as a slope. The bounds
/// are those of the two regressions, two standard errors outwards: sqrt((1 / r^2 - 1) / (n - 2)) of a slope (Draper and
/// Smith 1998, Applied Regression Analysis, 3rd ed., sections 1.4 and 1.6).
[[nodiscard]] inline std::optional<TurnRatio> turn_ratio(double gyro2, double both, double reference2, double pairs,
                                                         double least_correlation) {
  if (!(gyro2 > 0) || !(reference2 > 0) || !(pairs > 2)) return std::nullopt;
  const double correlation = both / std::sqrt(gyro2 * reference2);
  if (!(std::abs(correlation) > 0) || std::abs(correlation) < least_correlation) return std::nullopt;
  constexpr double kStandardErrors = 2;
  const double unexplained = std::max(0.0, 1 / (correlation * correlation) - 1);
  const double left = 1 - kStandardErrors * std::sqrt(unexplained / (pairs - 2));
  if (!(left > 0)) return std::nullopt;
  return TurnRatio{.low = std::abs(both) / reference2 * left,
                   .high = gyro2 / std::abs(both) / left,
                   .correlation = correlation,
                   .seconds = pairs};
}

}  // namespace tetap::doctor
