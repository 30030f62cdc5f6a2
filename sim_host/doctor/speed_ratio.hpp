// SPDX-License-Identifier: Apache-2.0
// The speed or way by one device over that of another.
#pragma once

#include <string>

namespace tetap::doctor {

struct SpeedRatio {
  double value = 1;
  double certainty = 1;
  std::string evidence;
};

/// Wheels, tyres and slip are within some percent; a wrong radius is a tenth and more.
[[nodiscard]] inline bool off(const SpeedRatio& ratio, double within = 1.15) {
  return ratio.value > within || ratio.value < 1 / within;
}

}  // namespace tetap::doctor
