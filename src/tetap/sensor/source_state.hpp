// SPDX-License-Identifier: Apache-2.0
// Words for what becomes of a source of measurements: its state, and the test that refused its last measurement.
#pragma once

#include <cstdint>

namespace tetap::sensor {

enum class SourceState : std::uint8_t {
  kStopped,     ///< no measurement yet, none of late, or switched off
  kConfirming,  ///< measurements wait for others that agree with them
  kFusing,      ///< the last measurement was used
  kRejecting,   ///< the last measurement was refused
  kDistrusted,  ///< measurements are left out until the source shows that it is right
};

/// Tests of a measurement. Every refusal names one.
enum class Check : std::uint8_t {
  kNone,         ///< no test failed
  kValue,        ///< not finite, or beyond what the model holds for
  kGate,         ///< innovation gate
  kDrift,        ///< measurements contradict the IMU for a second
  kFrozen,       ///< fixes keep their coordinates while the filter moves
  kStuck,        ///< readings repeat to the last bit
  kField,        ///< magnetic field of another strength or dip
  kHeading,      ///< motion shows another heading
  kSlip,         ///< a wheel turns otherwise than the robot moves
  kUnconfirmed,  ///< too few others agree yet
  kTrust,        ///< the source agrees again, but not yet for long enough
  kTime,         ///< sample overlaps the one before, or its interval is none
};

}  // namespace tetap::sensor
