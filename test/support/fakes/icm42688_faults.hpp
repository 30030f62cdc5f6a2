// SPDX-License-Identifier: Apache-2.0
// How the fake ICM-42688-P can fail, by name, and which rules of the data sheet it watches the host keep.
#pragma once

#include "support/fakes/icm42688_registers.hpp"

#include <cstddef>
#include <cstdint>
#include <string_view>

namespace tetap::fakes {

enum class Fault : std::uint8_t {
  kBusDead,          ///< transfer() returns false
  kBusStuckLow,      ///< every byte reads 0x00, writes are lost
  kBusStuckHigh,     ///< every byte reads 0xFF, writes are lost
  kBitFlips,         ///< read bits flip at `rate`, from `seed`
  kWrittenBitFlips,  ///< sent bits flip, address and data
  kWrongIdentity,    ///< WHO_AM_I reads `value`
  kRegisterRefuses,  ///< writes to `bank`/`address` are not taken
  kRegisterChanges,  ///< at once, `bank`/`address` becomes `value`; the chip acts on it
  kBrownOut,         ///< at once, power is lost and comes back: everything at its reset value
  kFifoStuck,        ///< the count stands still, the same packets are read again and again
  kAxisStuck,        ///< `axis` (0 to 2 gyroscope, 3 to 5 accelerometer) keeps its value
  kStampClockOff,    ///< only the stamps run fast by `ppm`; the samples come as before
  kSamplesLost,      ///< every `every`-th packet is missing, unannounced
  kSelfTestFails,    ///< `axis` answers its self test with a fifth of what it should
  kCount
};

struct FaultDetail {
  double rate = 1e-3;
  std::uint64_t seed = 1;
  std::uint8_t bank = 0;
  std::uint8_t address = icm42688::kGyroConfig0;
  std::uint8_t value = 0x44;  ///< as an identity: the sister part ICM-42686-P, of twice the scale
  int axis = 0;
  int ppm = 20'000;
  int every = 10;
  int after_transfers = 0;  ///< bus faults begin after so many good transfers
  int transfers = -1;       ///< transfers for which the fault lasts; -1: until cleared
};

/// Rules of the sheet for the host. Broken rules are counted; what the chip then does is in the second half.
enum class Rule : std::uint8_t {
  kNoAccessDuringReset,   ///< 14.1: 1 ms after a soft reset; reads give 0xFF, writes are lost
  kNoWriteInQuietTime,    ///< 14.36: 200 us after a sensor leaves OFF; the write is lost
  kGyroOnFor45ms,         ///< 14.36; counted only
  kNoChangeWhileRunning,  ///< 12.9: only rates, full scales and modes; taken nonetheless
  kSingleWrites,          ///< 9.6: "Single or Burst Reads and Single Writes"; only the first byte is taken
  kReservedBitsKept,      ///< 13: "this default value must be maintained"; stored as written
  kNoReservedValue,       ///< reserved rates, ranges, modes, banks; the sensor makes no samples
  kRegisterExists,        ///< a write to an address this bank does not have, most often the wrong bank
  kReadOnlyNotWritten,    ///< lost
  kRateFitsMode,          ///< 12.1: low noise from 12.5 Hz, low power up to 500 Hz; no samples
  kWatermarkNotZero,      ///< 14.47: "Do not set FIFO_WM to value 0" while its interrupt is routed; never fires
  kCount
};

[[nodiscard]] constexpr std::size_t index(Fault fault) { return static_cast<std::size_t>(fault); }
[[nodiscard]] constexpr std::size_t index(Rule rule) { return static_cast<std::size_t>(rule); }

[[nodiscard]] constexpr std::string_view name(Fault fault) {
  constexpr std::string_view kNames[] = {"bus dead",          "bus stuck low",  "bus stuck high",   "bit flips",
                                         "written bit flips", "wrong identity", "register refuses", "register changes",
                                         "brown-out",         "FIFO stuck",     "axis stuck",       "stamp clock off",
                                         "samples lost",      "self test fails"};
  return kNames[index(fault)];
}
[[nodiscard]] constexpr std::string_view name(Rule rule) {
  constexpr std::string_view kNames[] = {"no access during reset",  "no write in quiet time", "gyroscope on for 45 ms",
                                         "no change while running", "single writes",          "reserved bits kept",
                                         "no reserved value",       "register exists",        "read-only not written",
                                         "rate fits mode",          "watermark not zero"};
  return kNames[index(rule)];
}

}  // namespace tetap::fakes
