// SPDX-License-Identifier: Apache-2.0
// When an epoch was, on the robot's clock: receivers compute and send for a time that varies, but never less than the
// least. The least delay of the last windows of epochs is taken as the constant one, the rest as waiting.
#pragma once

#include "tetap/base/time.hpp"

#include <cstdint>
#include <optional>

namespace tetap::drivers::gnss {

class EpochClock {
 public:
  /// `latency`: from the measurement to the last byte of the least delayed epoch.
  explicit constexpr EpochClock(base::Micros latency) : latency_(latency) {}

  /// The receiver's own time of the epoch (of week or of day), and when its report was complete. Never later than that.
  constexpr base::Micros stamp(base::Micros receiver_time, base::Micros arrival) {
    const base::Micros offset = arrival - receiver_time;
    const base::Micros apart = running_ ? offset - least() : base::Micros{};
    if (!running_ || apart.us > kJump_us || apart.us < -kJump_us) {  // also the end of a week or day
      running_ = true;
      earlier_ = current_ = offset;
      epochs_ = 0;
    }
    if (offset < current_) current_ = offset;
    const base::Micros at = receiver_time + least() - latency_;
    if (++epochs_ == kWindow) {
      earlier_ = current_;
      current_ = offset;
      epochs_ = 0;
    }
    return at;
  }

  /// When an epoch was, by the delays of others, for a message that comes late by nature; it changes nothing. Empty: no
  /// epoch was stamped yet, or the message is later than any can be (the end of a week, a receiver that began anew).
  [[nodiscard]] constexpr std::optional<base::Micros> at(base::Micros receiver_time, base::Micros arrival) const {
    if (!running_) return {};
    const base::Micros offset = arrival - receiver_time, apart = offset - least();
    if (apart.us < -kJump_us || apart.us > kLatest_us) return {};
    return receiver_time + (offset < least() ? offset : least()) - latency_;
  }

 private:
  static constexpr std::int64_t kLatest_us = 5'000'000;  ///< ours: u-blox waits a second for the reference's data
  static constexpr std::int64_t kJump_us = 500'000;
  static constexpr int kWindow = 32;  ///< at 5 Hz and 50 ppm the clocks part by 0.3 ms in it
  [[nodiscard]] constexpr base::Micros least() const { return earlier_ < current_ ? earlier_ : current_; }

  base::Micros latency_;
  base::Micros earlier_{}, current_{};
  int epochs_ = 0;
  bool running_ = false;
};

}  // namespace tetap::drivers::gnss
