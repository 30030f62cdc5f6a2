// SPDX-License-Identifier: Apache-2.0
// The factor between a turn rate by the gyroscope and the same by another device, named by its unit.
#pragma once

#include "sim_host/doctor/finding.hpp"

#include <string>

namespace tetap::doctor {

/// `factor`: the gyroscope's turn over that of `reference`. Nothing is found for a factor of no known unit.
inline void name_gyro_unit(double factor, const std::string& reference, Devices uses, double seconds,
                           Findings& findings) {
  constexpr double kDegrees = 57.29577951308232, kWithin = 1.5;  // clipped increments make a factor smaller
  const bool degrees = factor > kDegrees / kWithin && factor < kDegrees * kWithin;
  const bool radians = factor > 1 / (kDegrees * kWithin) && factor < kWithin / kDegrees;
  if (!degrees && !radians) return;
  findings.push_back({.code = Code::kDegForRad,
                      .uses = static_cast<Devices>(kGyroscope | uses),
                      .evidence = text("The gyroscope turns %.3g times as fast as %s over %.0f s; %.3g is the factor "
                                       "between %s.",
                                       factor, reference.c_str(), seconds, degrees ? kDegrees : 1 / kDegrees,
                                       degrees ? "degrees and radians" : "radians and degrees"),
                      .change = degrees ? "" : "Leave out the factor pi/180: the gyroscope is in radians already."});
}

}  // namespace tetap::doctor
