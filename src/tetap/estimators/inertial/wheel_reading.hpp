// SPDX-License-Identifier: Apache-2.0
// Readings of wheels: speeds of two wheels, and the forward speed that follows.
#pragma once

#include "tetap/checks/wheel_slip.hpp"

namespace tetap::estimators {

/// Speeds of two wheels.
struct WheelReading {
  checks::WheelSlip::Wheels wheels;
  float sigma_mps = 0;  ///< 1 sigma of their mean by counting
  float later_mps = 0;  ///< gain of speed from the interval's middle to its end

  [[nodiscard]] float mean_mps() const { return 0.5F * (wheels.left_mps + wheels.right_mps); }
};

/// Forward speed of the middle of the axle.
struct ForwardReading {
  static constexpr float kUnknown_mps = 1e4F;  ///< sigma of a reading that is none: the constraint alone

  float mps = 0;
  float sigma_mps = 0;  ///< by counting: of one count over the interval
};

}  // namespace tetap::estimators
