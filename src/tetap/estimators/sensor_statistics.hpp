// SPDX-License-Identifier: Apache-2.0
// Statistics of one sensor in one estimator: counts of its verdicts and a sliding mean of its NIS.
#pragma once

#include "tetap/base/time.hpp"
#include "tetap/sensor/vocabulary.hpp"

#include <cstddef>
#include <cstdint>

namespace tetap::estimators {

/// Fates of one sensor's samples.
struct SensorStatistics {
  sensor::Sensor sensor = sensor::Sensor::kNotAvailable;  ///< not available: the entry is free
  std::uint8_t instance = 0;
  std::uint16_t accepted = 0;
  std::uint16_t rejected = 0;
  float nis_mean = 0;  ///< per degree of freedom, over the last 50 or so compared measurements
  std::uint8_t refused_in_a_row = 0;
  bool compared = false;
  base::Micros last_accepted;
};

/// Kinds and instances of sensors that one estimator keeps apart; what comes beyond shares the last entry.
inline constexpr std::size_t kStatistics = 12;

}  // namespace tetap::estimators
