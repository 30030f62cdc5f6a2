// SPDX-License-Identifier: Apache-2.0
// Health of a Bosch IMU as its driver reports it: a state, a reason for everything that went wrong, a count of each.
#pragma once

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

struct Health {
  State state = State::kStartup;
  Reason last = Reason::kCount;  ///< kCount: nothing yet
  std::uint32_t samples = 0;     ///< delivered since the start
  std::uint32_t restarts = 0;
  std::array<std::uint16_t, kReasons> counts{};  ///< saturating

  [[nodiscard]] constexpr std::uint16_t of(Reason reason) const { return counts[static_cast<std::size_t>(reason)]; }
  constexpr void add(Reason reason, std::int64_t times = 1) {
    auto& count = counts[static_cast<std::size_t>(reason)];
    const std::int64_t sum = count + times;
    count = static_cast<std::uint16_t>(sum > 0xFFFF ? 0xFFFF : sum);
    last = reason;
  }
};

}  // namespace tetap::drivers::bosch
