// SPDX-License-Identifier: Apache-2.0
// The yaw rate of the gyroscope over that of another device. Noise of one makes the slope too small, noise of the other
// too large: the two regressions enclose the factor.
#pragma once

#include "sim_host/doctor/codes.hpp"

#include <cmath>
#include <optional>

namespace tetap::doctor {

struct TurnRatio {
  const char* device = "";
  Devices uses = kNoDevice;
  double low = 0, high = 0;  ///< bounds of the factor's magnitude
  double correlation = 0;    ///< negative: the two turn against each other
  double seconds = 0;

  [[nodiscard]] double value() const { return std::sqrt(low * high); }
};

/// From the variances of gyroscope and reference and their covariance over so many pairs; nothing where they have
/// nothing in common. The bounds are two standard errors of a regression's slope wider (Draper and Smith, Applied
/// Regression Analysis, section 1.4): few pairs of noisy chords have a factor of their own.
[[nodiscard]] inline std::optional<TurnRatio> turn_ratio(double gyro2, double both, double reference2, double pairs,
                                                         double least_correlation) {
  if (!(gyro2 > 0) || !(reference2 > 0)) return std::nullopt;
  const double correlation = both / std::sqrt(gyro2 * reference2);
  if (std::abs(correlation) < least_correlation) return std::nullopt;
  constexpr double kErrors = 2;
  const double wider = 1 + kErrors * std::sqrt((1 / (correlation * correlation) - 1) / (pairs - 2));
  return TurnRatio{.low = std::abs(both) / reference2 / wider,
                   .high = gyro2 / std::abs(both) * wider,
                   .correlation = correlation,
                   .seconds = pairs};
}

}  // namespace tetap::doctor
