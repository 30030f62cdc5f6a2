// SPDX-License-Identifier: Apache-2.0
// Times to tick: on the board's own timer, on the bus's sync frames, or in lockstep with a player. The only part of the
// firmware that knows real time, and it decides nothing but the sequence of ticks, which every epoch frame states.
#pragma once

#include "tetap/base/time.hpp"
#include "tetap/bus/counters.hpp"
#include "tetap/bus/messages.hpp"

#include <cstdint>
#include <optional>

namespace tetap::firmware {

/// Rules.
///   Clock frame: sets the clock's offset; ticks stay the own timer's, at whole periods of the bus's time. A frame that
///   moves a running clock by more than kFarthest periods is refused and counted. It is taken when three in a row agree
///   or a guard vouches for it.
///   Tick frame:  tick at its time. Missing for three periods: hold over on the own timer. Back after three in a row
///   that are one period (+-10 %) apart and ahead of the last tick.
///   Step frame:  tick at its time, whatever it is. There is no own timer until a Tick or Clock frame comes, or no Step
///   has come for kLockstepPatience. Firmware asks LockstepPolicy before a Begin or Step gets here.
///   A Tick less than half a period or more than kFarthest periods ahead of the last tick is refused and counted. It is
///   taken when three in a row agree. A Tick that lets the bus's time run ahead of the board's is refused alike.
class Pacer {
 public:
  explicit constexpr Pacer(base::Micros period) : period_(period), credit_(times(kFarthest)) {}

  /// A sync frame that arrived at board time `now`; the time to tick at, if any.
  [[nodiscard]] constexpr std::optional<base::Micros> on_sync(bus::SyncKind kind, base::Micros time, base::Micros now,
                                                              bus::LoopHealth& health, bool vouched = false) {
    switch (kind) {
      case bus::SyncKind::kBegin:
        return lock(time, now), std::nullopt;
      case bus::SyncKind::kStep:
        return lock(time, now), time;
      case bus::SyncKind::kClock:
        return set_clock(time, now, vouched, health), std::nullopt;
      case bus::SyncKind::kTick:
        return follow(time, now, health);
    }
    return std::nullopt;
  }

  /// Called at each poll with the board's time; the time to tick at, if one is due.
  [[nodiscard]] constexpr std::optional<base::Micros> on_poll(base::Micros now, bus::LoopHealth& health) {
    if (state_ == bus::SyncState::kLockstep) {
      if (now - last_sync_arrival_ <= kLockstepPatience) return std::nullopt;
      ++health.sync_lost;
      state_ = bus::SyncState::kOwnTimer;
      offset_ = last_tick_ - last_sync_arrival_;
      next_tick_ = next_multiple(now + offset_);
    }
    if (state_ == bus::SyncState::kFollowing) {
      if (now - last_sync_arrival_ <= times(3)) return std::nullopt;
      ++health.sync_lost;
      state_ = bus::SyncState::kHoldover;
      in_a_row_ = 0;
      next_tick_ = last_tick_ + period_;
      waited_ = 3;
    }
    if (next_tick_.us == 0) next_tick_ = next_multiple(now + offset_);
    const base::Micros bus_now = now + offset_;
    if (bus_now < next_tick_) return std::nullopt;
    const std::int64_t behind = (bus_now - next_tick_).us / period_.us;
    // The periods that hold-over waited for a sync frame are not the loop's lateness.
    health.ticks_late = static_cast<std::uint16_t>(health.ticks_late + (behind > waited_ ? behind - waited_ : 0));
    waited_ = 0;
    last_tick_ = next_tick_ + times(behind);
    next_tick_ = last_tick_ + period_;
    return last_tick_;
  }

  [[nodiscard]] constexpr bus::SyncState state() const { return state_; }
  /// Bus time minus board time; without meaning in lockstep.
  [[nodiscard]] constexpr base::Micros offset() const { return offset_; }

  static constexpr base::Micros kLockstepPatience{2'000'000};

 private:
  static constexpr std::int64_t kFarthest = 50;
  [[nodiscard]] constexpr base::Micros times(std::int64_t n) const { return {n * period_.us}; }
  [[nodiscard]] constexpr base::Micros next_multiple(base::Micros t) const {
    return {(t.us / period_.us + 1) * period_.us};
  }

  /// True when the pacer has neither ticked nor been given a time.
  [[nodiscard]] constexpr bool fresh() const { return !on_bus_time_ && last_tick_.us == 0; }

  constexpr void lock(base::Micros time, base::Micros now) {
    state_ = bus::SyncState::kLockstep;
    on_bus_time_ = true;
    last_tick_ = time;
    last_sync_arrival_ = now;
  }

  /// A small correction keeps the sequence of ticks; a large one, or the first, begins it anew at a whole period.
  constexpr void set_clock(base::Micros time, base::Micros now, bool vouched, bus::LoopHealth& health) {
    const base::Micros correction = time - (now + offset_);
    const bool small = correction < times(kFarthest) && times(-kFarthest) < correction;
    const base::Micros apart = time - now - clock_offset_;
    in_a_row_ = apart.us * 10 < period_.us && -apart.us * 10 < period_.us ? in_a_row_ + 1 : 0;
    clock_offset_ = time - now;
    if (!small && !fresh() && !vouched && state_ != bus::SyncState::kLockstep && in_a_row_ < 2)
      return void(++(correction.us < 0 ? health.sync_back : health.sync_jump));
    in_a_row_ = 0;
    on_bus_time_ = true;
    offset_ = time - now;
    if (state_ == bus::SyncState::kOwnTimer && small && next_tick_.us != 0) return;
    state_ = bus::SyncState::kOwnTimer;
    next_tick_ = next_multiple(time);
  }

  constexpr std::optional<base::Micros> follow(base::Micros time, base::Micros now, bus::LoopHealth& health) {
    const base::Micros step = time - last_sync_;
    const bool regular = step.us * 10 >= period_.us * 9 && step.us * 10 <= period_.us * 11;
    in_a_row_ = regular ? in_a_row_ + 1 : 0;
    last_sync_ = time;
    const bool first = fresh();
    const bool back = time <= last_tick_;
    const bool early = (time - last_tick_).us * 2 < period_.us;
    const bool far = time > last_tick_ + times(kFarthest);
    if (!first && in_a_row_ < 2) {
      if (early) return ++health.sync_back, std::nullopt;
      if (far) return ++health.sync_jump, std::nullopt;
      if (state_ != bus::SyncState::kFollowing) return std::nullopt;
    }
    on_bus_time_ = true;
    if (state_ == bus::SyncState::kHoldover && back)
      return std::nullopt;  // its own ticks are ahead: wait until the bus is
    if (!first && !in_time(now)) return ++health.sync_jump, std::nullopt;
    // Two frames a period apart that are taken at nearly one moment: the loop was not there when the first one came.
    if (state_ == bus::SyncState::kFollowing && regular && (now - last_sync_arrival_).us * 2 < period_.us)
      ++health.ticks_late;
    state_ = bus::SyncState::kFollowing;
    last_sync_arrival_ = now;
    offset_ = time - now;
    last_tick_ = time;
    return time;
  }

  /// Whether the bus has a Tick to spare. It may send as many as a loop that stood still has missed. Otherwise it may
  /// send little more than the time that goes by on the board.
  constexpr bool in_time(base::Micros now) {
    credit_ += base::Micros{(now - credit_at_).us / 4 * 5};
    credit_at_ = now;
    if (credit_ > times(kFarthest)) credit_ = times(kFarthest);
    if (credit_ < period_) return false;
    credit_ = credit_ - period_;
    return true;
  }

  base::Micros period_;
  bus::SyncState state_ = bus::SyncState::kOwnTimer;
  base::Micros offset_;  ///< bus time minus board time
  base::Micros last_tick_;
  base::Micros next_tick_;
  base::Micros credit_;             ///< time that Tick frames may still take
  base::Micros credit_at_;          ///< board time of credit_
  base::Micros clock_offset_;       ///< offset that the last Clock frame stated, obeyed or not
  base::Micros last_sync_;          ///< time stated in the last Tick frame, accepted or not
  base::Micros last_sync_arrival_;  ///< board time of the last Begin, Step or accepted Tick frame
  std::int32_t in_a_row_ = 0;       ///< Tick frames one period apart, or Clock frames that agree
  std::int64_t waited_ = 0;         ///< periods that went by before hold-over began
  bool on_bus_time_ = false;        ///< the time of ticks has been the bus's before
};

}  // namespace tetap::firmware
