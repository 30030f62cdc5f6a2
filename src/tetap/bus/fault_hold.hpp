// SPDX-License-Identifier: Apache-2.0
// Fault bits, and those that stand for a second after a counter has moved.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/bus/counters.hpp"
#include "tetap/bus/messages.hpp"
#include "tetap/estimators/own_map.hpp"

#include <array>
#include <cstddef>
#include <cstdint>

namespace tetap::bus {

/// A bit per sensor::Fault.
struct FaultSet {
  std::uint16_t bits = 0;
  constexpr void raise(sensor::Fault fault, bool is = true) {
    bits = static_cast<std::uint16_t>(bits | (is ? 1U << static_cast<unsigned>(fault) : 0U));
  }
};

class FaultHold {
 public:
  void power_on() { *this = {}; }

  /// Once an epoch; `second` is how many epochs one lasts.
  void note(const Counters& now, std::uint32_t epoch, std::uint32_t second) {
    const Counters& then = last_;
    FaultSet raised;
    raised.raise(sensor::Fault::kIncomplete, now.incomplete != then.incomplete);
    raised.raise(sensor::Fault::kTooLate, now.too_late != then.too_late);
    raised.raise(sensor::Fault::kMalformed, now.malformed != then.malformed || now.out_of_range != then.out_of_range ||
                                                now.no_time != then.no_time || now.too_early != then.too_early ||
                                                now.guard_bad != then.guard_bad);
    raised.raise(sensor::Fault::kCapacity, now.map_full != then.map_full || now.timeline_full != then.timeline_full ||
                                               now.window_short != then.window_short ||
                                               now.events_dropped != then.events_dropped ||
                                               now.overload != then.overload);
    raised.raise(sensor::Fault::kCommandRefused, now.command_refused != then.command_refused ||
                                                     now.command_rate != then.command_rate ||
                                                     now.auth_bad != then.auth_bad || now.replayed != then.replayed);
    raised.raise(sensor::Fault::kIdConflict, now.two_senders != then.two_senders);
    if (raised.bits != 0) {
      bits_ = epoch < until_ ? static_cast<std::uint16_t>(bits_ | raised.bits) : raised.bits;
      until_ = epoch + second;
    }
    last_ = now;
  }
  [[nodiscard]] FaultSet faults(std::uint32_t epoch) const { return {epoch < until_ ? bits_ : std::uint16_t{0}}; }
  static constexpr auto members(auto& self) {
    return base::members(base::in_turns(self.last_), self.until_, self.bits_);
  }

 private:
  Counters last_;            ///< as they were an epoch ago
  std::uint32_t until_ = 0;  ///< epoch
  std::uint16_t bits_ = 0;   ///< raised since
};

/// A bit per MapFault, for a second after its counter in the report has moved.
class MapFaultHold {
 public:
  /// Once an epoch; `second` is how many epochs one lasts. A counter that fell is that of a map begun anew.
  void note(const estimators::MapReport& now, std::uint32_t epoch, std::uint32_t second) {
    const std::array<std::uint32_t, kFaults> counts{now.refused, now.ambiguous, now.jobs_aborted};
    for (std::size_t i = 0; i < kFaults; ++i) {
      if (counts[i] > counts_[i]) until_[i] = epoch + second;
      counts_[i] = counts[i];
    }
  }
  [[nodiscard]] std::uint8_t faults(std::uint32_t epoch) const {
    unsigned bits = 0;
    for (std::size_t i = 0; i < kFaults; ++i) bits |= epoch < until_[i] ? 1U << i : 0U;
    return static_cast<std::uint8_t>(bits);
  }
  static constexpr auto members(auto& self) { return base::members(self.counts_, self.until_); }

 private:
  static constexpr std::size_t kFaults = 3;
  static_assert(static_cast<int>(MapFault::kMapFull) == 0 && static_cast<int>(MapFault::kAssociationAmbiguous) == 1 &&
                static_cast<int>(MapFault::kJobsAborted) == 2);
  std::array<std::uint32_t, kFaults> counts_{};  ///< as they were an epoch ago
  std::array<std::uint32_t, kFaults> until_{};   ///< epoch
};
/// Its place in a node without a map of its own.
struct NoMapFaults {
  void note(const estimators::MapReport&, std::uint32_t, std::uint32_t) {}
  [[nodiscard]] std::uint8_t faults(std::uint32_t) const { return 0; }
};

}  // namespace tetap::bus
