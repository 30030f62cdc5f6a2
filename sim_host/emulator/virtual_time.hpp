// SPDX-License-Identifier: Apache-2.0
// Time of the emulated board: integer picoseconds from power-on, the alarms that models set, and the core's cycles.
// Nothing here reads the host's clock.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <utility>
#include <vector>

namespace tetap::board {

using Picoseconds = std::int64_t;  ///< 106 days fit
inline constexpr Picoseconds kNever = std::numeric_limits<Picoseconds>::max();
inline constexpr Picoseconds kMicrosecond = 1'000'000, kMillisecond = 1'000 * kMicrosecond,
                             kSecond = 1'000 * kMillisecond;

__extension__ using Wide = __int128;

/// Duration of `count` periods of `hz`, rounded down.
[[nodiscard]] constexpr Picoseconds periods(std::int64_t count, std::int64_t hz) {
  return static_cast<Picoseconds>(Wide{count} * kSecond / hz);
}

class Scheduler;

/// One thing that a model will do at a time. Its scheduler must live longer.
class Alarm {
 public:
  Alarm(Scheduler& scheduler, std::function<void()> action);
  Alarm(const Alarm&) = delete;
  Alarm& operator=(const Alarm&) = delete;

  void set(Picoseconds at);
  void clear() { set(kNever); }
  [[nodiscard]] bool pending() const { return at_ != kNever; }
  [[nodiscard]] Picoseconds at() const { return at_; }

 private:
  friend class Scheduler;
  Scheduler& scheduler_;
  std::function<void()> action_;
  Picoseconds at_ = kNever;
};

/// Runs alarms in the order of their times; those of one time in the order in which they were made.
class Scheduler {
 public:
  [[nodiscard]] Picoseconds now() const { return now_; }
  [[nodiscard]] Picoseconds next() const { return next_; }

  /// Runs what is due up to `until`, which becomes now.
  void advance(Picoseconds until) {
    while (next_ <= until) run_earliest();
    if (until > now_) now_ = until;
  }

 private:
  friend class Alarm;

  void plan() {
    next_ = kNever;
    for (const Alarm* alarm : alarms_) next_ = alarm->at_ < next_ ? alarm->at_ : next_;
  }
  void run_earliest() {
    Alarm* earliest = nullptr;
    for (Alarm* alarm : alarms_) {
      if (alarm->at_ == next_) {
        earliest = alarm;
        break;
      }
    }
    if (next_ > now_) now_ = next_;
    earliest->at_ = kNever;
    plan();
    earliest->action_();
  }

  std::vector<Alarm*> alarms_;
  Picoseconds now_ = 0;
  Picoseconds next_ = kNever;
};

inline Alarm::Alarm(Scheduler& scheduler, std::function<void()> action)
    : scheduler_(scheduler), action_(std::move(action)) {
  scheduler_.alarms_.push_back(this);
}

inline void Alarm::set(Picoseconds at) {
  at_ = at < scheduler_.now() ? scheduler_.now() : at;
  scheduler_.plan();
}

/// Cycles of the core and their time: the frequency may change, the count goes on.
class CoreClock {
 public:
  [[nodiscard]] std::int64_t hz() const { return hz_; }
  [[nodiscard]] Picoseconds time_of(std::int64_t cycles) const {
    const std::int64_t since = cycles - base_cycles_;
    if (since >= 0 && since < kShort) return base_time_ + since * kSecond / hz_;  // fits into 64 bits
    return base_time_ + static_cast<Picoseconds>(Wide{since} * kSecond / hz_);
  }
  /// The first cycle at or after `time`.
  [[nodiscard]] std::int64_t cycle_at(Picoseconds time) const {
    if (time == kNever) return std::numeric_limits<std::int64_t>::max();
    const Wide scaled = Wide{time - base_time_} * hz_;
    return base_cycles_ + static_cast<std::int64_t>((scaled + kSecond - 1) / kSecond);
  }
  /// Moves the base of the count on by whole 64ths of a second: the same times, by shorter divisions.
  void settle(std::int64_t cycles) {
    const std::int64_t slice = hz_ / 64;
    if (hz_ % 64 != 0 || cycles - base_cycles_ < slice) return;
    const std::int64_t slices = (cycles - base_cycles_) / slice;
    base_cycles_ += slices * slice;
    base_time_ += slices * (kSecond / 64);
  }
  /// From `time` on.
  void change(Picoseconds time, std::int64_t hz) {
    base_cycles_ = cycle_at(time);
    base_time_ = time;
    hz_ = hz;
  }

 private:
  static constexpr std::int64_t kShort = 9'000'000;  ///< most cycles that fit into 64 bits, times 1e12
  std::int64_t hz_ = 16'000'000;
  std::int64_t base_cycles_ = 0;
  Picoseconds base_time_ = 0;
};

}  // namespace tetap::board
