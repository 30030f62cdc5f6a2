// SPDX-License-Identifier: Apache-2.0
// States and reasons in the health of an ICM-42688-P.
#pragma once

#include "drivers/imu/health.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace tetap::drivers::icm42688 {

enum class State : std::uint8_t {
  kPowerUp,
  kReset,
  kIdentify,
  kConfigure,
  kVerify,
  kWarmUp,
  kRunning,
  kSelfTest,
  kMisconfigured  ///< settings the chip cannot have: nothing is ever sent
};

enum class Reason : std::uint8_t {
  kBusFault,         ///< a transfer failed
  kResetIncomplete,  ///< no "reset done" after the time it may take
  kWrongIdentity,    ///< WHO_AM_I is not that of this chip
  kConfigRefused,    ///< a register did not keep what was written
  kConfigChanged,    ///< a register changed while running: configured again
  kBankLost,         ///< the chip was in another bank than it was put into
  kFifoOverflow,     ///< samples were lost in the chip: polled too rarely
  kBadCount,         ///< more bytes than the FIFO can hold, or a broken packet
  kBadHeader,        ///< a packet of another kind than configured: FIFO flushed
  kFifoShort,        ///< fewer packets than counted
  kInvalidSample,    ///< the chip's marker for "no data"
  kRateChanged,      ///< a packet header with another data rate
  kLostSamples,      ///< stamps with a gap, in samples
  kBadStamp,         ///< a stamp that did not go on: the sample was dropped
  kStale,            ///< no sample for too long
  kStuckAccel,       ///< the same values for too long; withheld until they move
  kStuckGyro,
  kRepeatedGyro,  ///< all three axes as before, amid a turn; delivered
  kClippedAccel,  ///< at the end of the range; delivered and marked
  kClippedGyro,
  kClockOff,  ///< the chip's clock is further off than it may be
  kSelfTestFailed,
  kCount
};

inline constexpr auto kReasons = static_cast<std::size_t>(Reason::kCount);

[[nodiscard]] constexpr std::string_view name(Reason reason) {
  constexpr std::array<std::string_view, kReasons> kNames = {"bus fault",
                                                             "reset incomplete",
                                                             "wrong identity",
                                                             "configuration refused",
                                                             "configuration changed",
                                                             "bank lost",
                                                             "FIFO overflow",
                                                             "bad FIFO count",
                                                             "bad packet header",
                                                             "FIFO shorter than counted",
                                                             "no-data marker",
                                                             "data rate changed",
                                                             "samples lost",
                                                             "bad stamp",
                                                             "stale",
                                                             "accel stuck",
                                                             "gyro stuck",
                                                             "gyro repeated",
                                                             "accel clipped",
                                                             "gyro clipped",
                                                             "clock off",
                                                             "self test failed"};
  return reason < Reason::kCount ? kNames[static_cast<std::size_t>(reason)] : std::string_view{"?"};
}

using Health = ImuDriverHealth<State, Reason>;

}  // namespace tetap::drivers::icm42688
