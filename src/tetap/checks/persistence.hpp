// SPDX-License-Identifier: Apache-2.0
// Age of a stamp, and how long a condition has held: the two questions every check asks of time. A stamp of 0 means
// "never". PX4 has the first as `isTimedOut`, the second as `hysteresis`.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/base/time.hpp"

#include <cstdint>
#include <limits>

namespace tetap::checks {

/// True while `last` is less than `within` ago; an event that never happened is not recent.
[[nodiscard]] constexpr bool recent(base::Micros last, base::Micros now, base::Micros within) {
  return last.us > 0 && now - last < within;
}

/// True once `last` is more than `than` ago; an event that never happened is older than any span.
[[nodiscard]] constexpr bool older(base::Micros last, base::Micros now, base::Micros than) {
  return !(last.us > 0) || now - last > than;
}

/// A condition persists when it has held at so many tests in a row, for so long. Limits are the caller's, at each test.
/// A run that began more than 71 minutes before its last test counts as one of 71 minutes.
class Persistence {
 public:
  static constexpr base::Micros kNoGap{std::numeric_limits<std::int64_t>::max() / 2};

  /// One test at `stamp`. A test that fails ends the run; so does a pause of more than `max_gap` between two that hold.
  constexpr void update(bool holds, base::Micros stamp, base::Micros max_gap = kNoGap) {
    if (!holds || (count_ > 0 && stamp - last() > max_gap)) count_ = 0;
    if (!holds) return;
    constexpr base::Micros kLongest{std::numeric_limits<std::uint32_t>::max()};
    if (count_ == 0) since_ = stamp;
    if (stamp - since_ > kLongest) since_ = stamp - kLongest;
    span_us_ = static_cast<std::uint32_t>((stamp - since_).us);
    if (count_ < kMost) ++count_;
  }
  constexpr void reset() { *this = {}; }

  /// Tests in a row that held.
  [[nodiscard]] constexpr std::int32_t count() const { return count_; }
  [[nodiscard]] constexpr bool holds() const { return count_ > 0; }
  /// From the first test of the run to `now`; zero while there is none.
  [[nodiscard]] constexpr base::Micros held_for(base::Micros now) const {
    return count_ > 0 ? now - since_ : base::Micros{0};
  }
  /// The run is at least `at_least` tests and, at `now`, at least `for_` long.
  [[nodiscard]] constexpr bool persists(base::Micros now, base::Micros for_, std::int32_t at_least = 1) const {
    return count_ > 0 && count_ >= at_least && now - since_ >= for_;
  }
  /// The same up to the last test that held: time without a test does not count.
  [[nodiscard]] constexpr bool persisted(base::Micros for_, std::int32_t at_least = 1) const {
    return persists(last(), for_, at_least);
  }

  static constexpr auto members(auto& self) { return base::members(self.since_, self.span_us_, self.count_); }

 private:
  static constexpr std::int32_t kMost = 1'000'000;  ///< the count stays there

  [[nodiscard]] constexpr base::Micros last() const { return {since_.us + span_us_}; }

  base::Micros since_;         ///< first test of the run
  std::uint32_t span_us_ = 0;  ///< from there to the last test that held
  std::int32_t count_ = 0;     ///< tests in a row that held; 0: the last one failed
};

}  // namespace tetap::checks
