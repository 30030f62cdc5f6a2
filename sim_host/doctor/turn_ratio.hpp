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
  [[nodiscard]] bool holds(double factor) const { return low < factor && factor < high; }
};

/// From the variances of gyroscope and reference and their covariance; nothing where they have nothing in common.
[[nodiscard]] inline std::optional<TurnRatio> turn_ratio(double gyro2, double both, double reference2,
                                                         double least_correlation) {
  if (!(gyro2 > 0) || !(reference2 > 0)) return std::nullopt;
  const double correlation = both / std::sqrt(gyro2 * reference2);
  if (std::abs(correlation) < least_correlation) return std::nullopt;
  return TurnRatio{.low = std::abs(both) / reference2, .high = gyro2 / std::abs(both), .correlation = correlation};
}

}  // namespace tetap::doctor
