// SPDX-License-Identifier: Apache-2.0
// Choices by number between a program on the emulated board and the test that runs it.
#pragma once

#include <cstdint>

namespace tetap::board {

/// programs/core.cpp: exceptions, masks, sleep, floating point and faults.
enum Choice : std::uint32_t {
  kFloatInHandler = 1,
  kMasks,
  kPriorities,
  kSleep,
  kUndefined,
  kUnmapped,
  kFloatingPointOff,
  kUnalignedDouble,
  kArmState,
  kStackGuard,
  kReset,
  kInterruptNotCleared,
  kCycles,
  kLockup,
  kUnalignedWord,
  kSupervisor,
  kUnalignedFloat,
};

/// programs/flash.cpp: what the core sees of its own flash's controller.
enum FlashChoice : std::uint32_t {
  kEraseFromFlash = 1,
  kPollFromRam,
  kReadFromRam,
  kReturnToFlash,
  kProgramWords,
  kLockedStore,
};

/// programs/sensors.cpp: one mistake each, but for the first.
enum Mistake : std::uint32_t {
  kNone,
  kPriorityById,
  kRequestNotCleared,
  kWatchdogBeforeExercise,
  kReloadTooSmall,
  kDataBeforeEmpty,
  kFifoNotReleased,
  kSelectEarly,
  kLoopStalled,
  kWrongStream,
};

}  // namespace tetap::board
