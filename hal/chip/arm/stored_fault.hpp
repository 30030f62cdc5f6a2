// SPDX-License-Identifier: Apache-2.0
// A fault's record in memory that a reset keeps: written by the fault handler, taken once by the next start. ARM DDI
// 0403E.e B1.5.6 (stacked frame), B3.2.15 to B3.2.18 (fault status and address).
#pragma once

#include "hal/board_report.hpp"
#include "hal/chip/arm/cortex_m4.hpp"

#include <array>
#include <cstdint>
#include <optional>

namespace tetap::hal {

/// The fault registers and the stacked frame at the entry of the handler.
struct FaultState {
  std::uint32_t exception = 0;  ///< its number
  bool stack_left = false;      ///< the stack pointer is outside of the stack: there is no frame
  std::uint32_t guard = 0;      ///< address of the 32 bytes below the stack
  std::uint32_t stacked_lr = 0, stacked_pc = 0;
  std::uint32_t cfsr = 0, mmfar = 0, bfar = 0;
};

[[nodiscard]] constexpr FaultRecord describe(const FaultState& s) {
  namespace scb = cortex_m4::scb;
  constexpr std::uint32_t kNmi = 2, kHardFault = 3, kMemManage = 4, kBusFault = 5, kUsageFault = 6;
  FaultRecord record{.program_counter = s.stacked_pc, .link_register = s.stacked_lr, .status = s.cfsr};
  if (scb::kMmarvalid.of(s.cfsr) != 0) record.address = s.mmfar;
  if (scb::kBfarvalid.of(s.cfsr) != 0) record.address = s.bfar;
  const bool in_guard = record.address >= s.guard && record.address - s.guard < 32;
  switch (s.exception) {
    case kHardFault:
      record.fault = CpuFault::kHard;
      break;
    case kMemManage:
      record.fault = in_guard || scb::kMstkerr.of(s.cfsr) != 0 ? CpuFault::kStack : CpuFault::kMemory;
      break;
    case kBusFault:
      record.fault = CpuFault::kBus;
      break;
    case kUsageFault:
      record.fault = CpuFault::kUsage;
      break;
    case kNmi:
    default:  // nobody's: its number is all there is to know
      record.fault = CpuFault::kUnexpected;
      record.status = s.exception;
      break;
  }
  if (s.stack_left && s.exception >= kHardFault && s.exception <= kBusFault) record.fault = CpuFault::kStack;
  return record;
}

/// Lies in .noinit: after a power-on its words are chance.
class StoredFault {
 public:
  void store(const FaultRecord& record) {
    words_ = pack(record);
    check_ = check(words_);
  }

  /// The record, once; empty: none was left.
  [[nodiscard]] std::optional<FaultRecord> take() {
    const bool valid = check_ == check(words_);
    check_ = ~check(words_);
    if (!valid || words_[0] > static_cast<std::uint32_t>(CpuFault::kUnexpected)) return std::nullopt;
    return FaultRecord{.fault = static_cast<CpuFault>(words_[0]),
                       .program_counter = words_[1],
                       .link_register = words_[2],
                       .address = words_[3],
                       .status = words_[4]};
  }

 private:
  using Words = std::array<std::uint32_t, 5>;

  [[nodiscard]] static constexpr Words pack(const FaultRecord& r) {
    return {static_cast<std::uint32_t>(r.fault), r.program_counter, r.link_register, r.address, r.status};
  }
  /// FNV-1a over the words: neither all zeros nor all ones are valid.
  [[nodiscard]] static constexpr std::uint32_t check(const Words& words) {
    std::uint32_t hash = 2'166'136'261U;
    for (const std::uint32_t word : words) hash = (hash ^ word) * 16'777'619U;
    return hash;
  }

  Words words_;
  std::uint32_t check_;
};

/// The record of an image, which its startup.cpp defines.
extern StoredFault stored_fault;

}  // namespace tetap::hal
