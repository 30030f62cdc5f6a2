// SPDX-License-Identifier: Apache-2.0
// Facts that a board knows about its own start and memory, sent as pages of Est_Diag.
#pragma once

#include <cstdint>

namespace tetap::hal {

/// Cause of the last reset of the processor. The bus sends the numbers as they stand here.
enum class BootCause : std::uint8_t {
  kUnknown = 0,
  kPowerOn = 1,
  kPin = 2,       ///< reset pin alone
  kBrownOut = 3,  ///< supply below its limit
  kSoftware = 4,  ///< asked for by the program, but not by a fault handler
  kWatchdog = 5,  ///< the loop did not come round in time
  kLowPower = 6,  ///< a low-power mode that is not allowed
  kCpuFault = 7,  ///< asked for by a fault handler, which left a record
};

/// Kind of a processor's fault. The bus sends the numbers as they stand here.
enum class CpuFault : std::uint8_t {
  kNone = 0,
  kHard = 1,       ///< a fault without a kind of its own, or within a fault handler
  kMemory = 2,     ///< access that the protection unit refuses
  kBus = 3,        ///< access that the bus refuses
  kUsage = 4,      ///< instruction undefined, operand unaligned
  kStack = 5,      ///< access to the guard below the stack
  kUnexpected = 6  ///< an exception or interrupt without a handler
};

/// Record of a fault handler, in memory that a reset keeps.
struct FaultRecord {
  CpuFault fault = CpuFault::kNone;   ///< kNone: the last reset was not a fault's
  std::uint32_t program_counter = 0;  ///< address of the instruction, as stacked
  std::uint32_t link_register = 0;    ///< address of the caller, as stacked
  std::uint32_t address = 0;          ///< address of the access; 0: not known
  std::uint32_t status = 0;           ///< the core's own fault status register
};

/// Facts about this start, which do not change until the next one.
struct BootReport {
  BootCause cause = BootCause::kUnknown;
  bool fallback_clock = false;  ///< no crystal: the core runs on its internal oscillator
  FaultRecord fault{};
};

struct StackUse {
  std::uint32_t reserved = 0;  ///< bytes of the stack's reservation
  std::uint32_t used = 0;      ///< high-water mark since reset, in bytes
};

}  // namespace tetap::hal
