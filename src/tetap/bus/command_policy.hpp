// SPDX-License-Identifier: Apache-2.0
// Commands that are obeyed, among those that arrive whole: the next ones by their counter, and few in a time. Both are
// judged by the node's time, so a replay judges alike.
#pragma once

#include "tetap/base/time.hpp"
#include "tetap/bus/counters.hpp"

#include <array>
#include <cstddef>
#include <cstdint>

namespace tetap::bus {

enum class CommandKind : std::uint8_t { kReset, kSetPose };

class CommandPolicy {
 public:
  void power_on() { *this = {}; }

  [[nodiscard]] bool repeats(CommandKind kind, std::uint8_t counter) const { return of(kind).last == counter; }

  /// A command is obeyed when its counter is one to three ahead of the last obeyed one (two may be lost). A command is
  /// obeyed too when it follows one that was refused for its counter. A sender that begins anew is obeyed with its
  /// second command.
  [[nodiscard]] [[gnu::cold, gnu::noinline]] bool admits(CommandKind kind, std::uint8_t counter, base::Micros now,
                                                         Counters& counters) {
    Sequence& sequence = of(kind);
    const unsigned ahead = (counter - sequence.last) & 0x0FU;
    const bool follows = sequence.refused != kNone && ((counter - sequence.refused) & 0x0FU) == 1;
    if (sequence.last != kNone && (ahead == 0 || ahead > kMostAhead) && !follows) {
      sequence.refused = counter;
      return ++counters.command_refused, false;
    }
    sequence = {.last = counter};
    return in_time(now) || (++counters.command_rate, false);
  }

 private:
  static constexpr std::uint8_t kNone = 0xFF;
  static constexpr unsigned kMostAhead = 3;
  static constexpr base::Micros kEach{500'000}, kAtOnce{2'000'000};  ///< a command in so long; as many as fit in this

  struct Sequence {
    std::uint8_t last = kNone;     ///< counter of the last command that was in order
    std::uint8_t refused = kNone;  ///< counter of the last one that was not, if none has been in order since
  };
  [[nodiscard]] Sequence& of(CommandKind kind) { return sequences_[static_cast<std::size_t>(kind)]; }
  [[nodiscard]] const Sequence& of(CommandKind kind) const { return sequences_[static_cast<std::size_t>(kind)]; }

  /// Resets and poses together: both end the window and begin estimators anew.
  [[nodiscard]] bool in_time(base::Micros now) {
    if (spent_until_ > now + kAtOnce || spent_until_ < now) spent_until_ = now;  // the first, or time has jumped
    if (spent_until_ + kEach > now + kAtOnce) return false;
    spent_until_ += kEach;
    return true;
  }

  std::array<Sequence, 2> sequences_{};
  base::Micros spent_until_;  ///< the time up to which commands have used what is allowed
};

}  // namespace tetap::bus
