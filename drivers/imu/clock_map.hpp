// SPDX-License-Identifier: Apache-2.0
// A sensor's own clock as seen by the MCU's. A sample cannot be read before it exists, and the luckiest reading comes
// at once. The line under all pairs (ticks, time of reading) is the sensor's clock. Its offset follows the lowest pair
// of each window, its rate the change of the offset between windows (a loop of second order; poles at 0.71). At first
// the rate is that of a growing base line between lowest pairs: a window alone has the chance of its readings.
#pragma once

#include "tetap/base/time.hpp"

#include <cstdint>

namespace tetap::drivers {

class ClockMap {
 public:
  /// Microseconds per tick in units of 2^-32.
  explicit constexpr ClockMap(std::int64_t nominal_q32) : nominal_(nominal_q32), rate_(nominal_q32) {}

  [[nodiscard]] constexpr bool running() const { return running_; }

  /// The ticks will begin anew: the place is forgotten, the rate stays.
  constexpr void stop() { running_ = false; }

  constexpr void start(std::int64_t ticks, base::Micros now) {
    running_ = true;
    anchor_ticks_ = ticks;
    anchor_ = now;
    fraction_ = slew_ = 0;
    window_us_ = kFirstWindow_us;
    if (long_windows_ < kFirstWindows) long_windows_ = 0;
    open_window(ticks);
  }

  /// Ticks within minutes of the last observed ones.
  [[nodiscard]] constexpr base::Micros time(std::int64_t ticks) const {
    return anchor_ + base::Micros{((ticks - anchor_ticks_) * (rate_ + slew_) + fraction_) >> 32};
  }

  /// The inverse, for times as near.
  [[nodiscard]] constexpr std::int64_t ticks(base::Micros time) const {
    constexpr std::int64_t kFar_us = 60'000'000;
    std::int64_t us = (time - anchor_).us;
    us = us > kFar_us ? kFar_us : us < -kFar_us ? -kFar_us : us;
    return anchor_ticks_ + (us << 28) / ((rate_ + slew_) >> 4);
  }

  /// The newest sample had `ticks` when the clock showed `now`. False: too far in the future, not used.
  constexpr bool observe(std::int64_t ticks, base::Micros now) {
    const std::int64_t late_us = (now - time(ticks)).us;
    if (late_us < -(rate_known_ ? kSettled_us : kUnsettled_us)) return false;
    const std::int64_t suspect_us = suspect_us_;
    suspect_us_ = late_us < -kSuspect_us ? late_us : 0;
    if (late_us < -kSuspect_us && suspect_us >= -kSuspect_us) return true;  // one stamp alone moves nothing by so much
    if (late_us < 0) {                                                      // it would have been read before it existed
      anchor_ += base::Micros{late_us};
      pulled_us_ += late_us;
      least_us_ = 0;
      low_ = {ticks, now};
    } else if (late_us < least_us_) {
      least_us_ = late_us;
      low_ = {ticks, now};
    }
    if ((time(ticks) - window_start_).us >= window_us_) close_window(ticks);
    return true;
  }

  /// Chip time over MCU time as learned, in parts per million of the nominal.
  [[nodiscard]] constexpr std::int32_t rate_error_ppm() const {
    return static_cast<std::int32_t>((rate_ - nominal_) * 1'000'000 / nominal_);
  }
  /// At the end of what the chip's oscillator can do: something else is wrong.
  [[nodiscard]] constexpr bool rate_at_limit() const {
    return rate_ >= nominal_ + nominal_ / kLimitParts || rate_ <= nominal_ - nominal_ / kLimitParts;
  }

 private:
  static constexpr std::int64_t kFirstWindow_us = 32'000;
  static constexpr std::int64_t kLastWindow_us = 1'024'000;
  static constexpr std::int64_t kLimitParts = 16;  // 6 %
  static constexpr std::int64_t kUnsettled_us = 20'000;
  static constexpr std::int64_t kSettled_us = 1'000;
  static constexpr std::int64_t kSuspect_us = 5'000;
  static constexpr std::int64_t kLost_us = 3'000;  ///< no reading of a window closer than that: learn anew
  static constexpr std::int64_t kNone_us = 1'000'000;
  static constexpr std::int64_t kLuck_us = 1'000;  ///< lowest pairs of short windows differ by up to a chip's sample
  static constexpr int kFirstWindows = 8;          ///< long windows whose rate is that of a growing base line
  struct Pair {
    std::int64_t ticks = 0;
    base::Micros time{};
  };

  constexpr void open_window(std::int64_t ticks) {
    window_ticks_ = ticks;
    window_start_ = time(ticks);
    least_us_ = kNone_us;
    pulled_us_ = 0;
  }

  constexpr void close_window(std::int64_t ticks) {
    const bool settled = window_us_ >= kLastWindow_us;
    if (settled && least_us_ > kLost_us) {
      rate_known_ = false;
      long_windows_ = 0;
      return start(ticks, time(ticks) + base::Micros{least_us_});
    }
    const std::int64_t moved_us = least_us_ + pulled_us_;
    // The line goes on from where it is, so that no interval is torn by a change of rate.
    const std::int64_t ahead = (ticks - anchor_ticks_) * (rate_ + slew_) + fraction_;
    anchor_ += base::Micros{ahead >> 32};
    fraction_ = ahead & 0xFFFF'FFFF;
    anchor_ticks_ = ticks;
    const std::int64_t span = ticks - window_ticks_;
    if (span > 0) {
      learn_rate(moved_us, span, settled);
      const std::int64_t limit = nominal_ / kLimitParts;
      rate_ = rate_ > nominal_ + limit ? nominal_ + limit : rate_ < nominal_ - limit ? nominal_ - limit : rate_;
      slew_ = settled ? (least_us_ << 32) / (2 * span) : 0;
      slew_ = slew_ > limit ? limit : slew_;
      if (!settled) anchor_ += base::Micros{least_us_};
    }
    rate_known_ |= settled;
    if (!settled) window_us_ *= 2;
    open_window(ticks);
  }

  /// `moved_us`: of the offset in a window of `span` ticks. Once the rate is known, a restart looks for the place
  /// alone.
  constexpr void learn_rate(std::int64_t moved_us, std::int64_t span, bool settled) {
    if (long_windows_ == kFirstWindows) {
      rate_ += settled ? (moved_us << 32) / span / 8 : 0;
      return;
    }
    if (window_us_ == kFirstWindow_us) {
      first_low_ = low_;
      return;
    }
    // Readings meet samples by chance. The lowest pairs of two windows, far apart, have the least of that.
    const std::int64_t apart = low_.ticks - first_low_.ticks;
    const std::int64_t rate = apart > 0 ? ((low_.time - first_low_.time).us << 32) / apart : rate_;
    const std::int64_t by_us = ((rate - rate_) * apart) >> 32;
    if (long_windows_ > 1) {
      if (apart * (nominal_ >> 16) >= kLastWindow_us << 16) rate_ = rate;
    } else if (by_us > kLuck_us || by_us < -kLuck_us) {
      rate_ = rate;
    }
    if (!settled) return;
    if (long_windows_ == 0) first_low_ = low_;
    ++long_windows_;
  }

  std::int64_t nominal_;
  std::int64_t rate_;
  std::int64_t slew_ = 0;  ///< on top of the rate, for one window: what the offset still has to move
  base::Micros anchor_{};
  std::int64_t fraction_ = 0;  ///< fraction of the anchor, 2^-32 us
  std::int64_t anchor_ticks_ = 0;
  std::int64_t window_ticks_ = 0;
  base::Micros window_start_{};
  std::int64_t window_us_ = kFirstWindow_us;
  std::int64_t least_us_ = kNone_us;  ///< the lowest pair of the window, above the line
  std::int64_t pulled_us_ = 0;        ///< sum by which the line was pulled down within the window
  std::int64_t suspect_us_ = 0;
  Pair low_;              ///< the lowest of this window
  Pair first_low_;        ///< lowest of the first window, then of the first long one
  int long_windows_ = 0;  ///< closed, up to kFirstWindows
  bool running_ = false;
  bool rate_known_ = false;  ///< once settled
};

}  // namespace tetap::drivers
