// SPDX-License-Identifier: Apache-2.0
// One sample of an IMU in SI and in the body's axes, before it is integrated to increments.
#pragma once

#include "drivers/imu/mounting.hpp"
#include "tetap/base/time.hpp"

namespace tetap::drivers {

struct ImuReading {
  base::Micros stamp{};  ///< when the motion was, on the MCU's clock: not when it was read, nor when the chip's filter
                         ///< let it out
  base::Micros interval{};  ///< time since the sample before, by the chip's ticks
  Vector3 rate_b_radps{};
  Vector3 force_b_mps2{};      ///< specific force: +g upwards at rest
  float temperature_degC = 0;  ///< NaN: not available
  bool after_gap = false;      ///< samples before this one are missing; `interval` is one nominal period
  bool clipped_gyro = false;
  bool clipped_accel = false;
};

}  // namespace tetap::drivers
