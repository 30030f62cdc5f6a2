// SPDX-License-Identifier: Apache-2.0
// States and reasons in the health of a Bosch IMU.
#pragma once

#include "drivers/imu/health.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace tetap::drivers::bosch {

enum class State : std::uint8_t {
  kStartup,
  kVerify,
  kRunning,
  kMisconfigured  ///< settings the chip cannot have, or no configuration file: nothing is ever sent
};

enum class Reason : std::uint8_t {
  kBusFault,       ///< a transfer failed
  kWrongIdentity,  ///< CHIP_ID is not that of this chip
  kFileRefused,    ///< the chip did not accept its configuration file
  kConfigRefused,  ///< a register did not keep what was written
  kConfigChanged,  ///< a register changed while running: begun again
  kLostSamples,    ///< samples that were not read in time
  kBadStamp,       ///< the sensor time went on further than the MCU's clock: begun anew
  kStale,          ///< no sample for too long: begun again
  kStuckAccel,     ///< an axis with the same value for too long; withheld until it moves
  kStuckGyro,
  kClippedAccel,  ///< at the end of the range; delivered and marked
  kClippedGyro,
  kCount
};

inline constexpr auto kReasons = static_cast<std::size_t>(Reason::kCount);

[[nodiscard]] constexpr std::string_view name(Reason reason) {
  constexpr std::array<std::string_view, kReasons> kNames = {"bus fault",
                                                             "wrong identity",
                                                             "configuration file refused",
                                                             "configuration refused",
                                                             "configuration changed",
                                                             "samples lost",
                                                             "bad stamp",
                                                             "stale",
                                                             "accel stuck",
                                                             "gyro stuck",
                                                             "accel clipped",
                                                             "gyro clipped"};
  return reason < Reason::kCount ? kNames[static_cast<std::size_t>(reason)] : std::string_view{"?"};
}

using Health = ImuDriverHealth<State, Reason>;

}  // namespace tetap::drivers::bosch
