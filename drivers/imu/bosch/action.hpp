// SPDX-License-Identifier: Apache-2.0
// A chip's start as a table of actions, which one driver carries out and checks for all chips.
#pragma once

#include "drivers/imu/bosch/health.hpp"

#include <cstdint>

namespace tetap::drivers::bosch {

enum class Kind : std::uint8_t {
  kTouch,   ///< a read whose value means nothing: it selects SPI
  kWrite,   ///< a command
  kKeep,    ///< a field that stays: read back before running, then in turn
  kExpect,  ///< a field that must be so, now and in turn
  kUpload,  ///< the configuration file, in parts
  kLearn    ///< a value for the chip's conversion
};

struct Action {
  Kind kind;
  std::uint8_t target;  ///< 0 the chip or its accelerometer, 1 its gyroscope
  std::uint8_t address;
  std::uint8_t mask = 0xFF;
  std::uint8_t value = 0;
  std::int32_t wait_us = 0;  ///< before the next one
  Reason otherwise = Reason::kWrongIdentity;
};

}  // namespace tetap::drivers::bosch
