// SPDX-License-Identifier: Apache-2.0
// The time of the bus at each frame of a log. It is In_Sync where the log has it, else the node's epochs, else the
// log's own clock. Between two of these the log's clock goes on, but by a period at most. A log of a lockstep run is
// written faster than its time.
#pragma once

#include "sim_host/replay/protocol.hpp"
#include "tetap/base/time.hpp"
#include "tetap/bus/codec.hpp"

#include <algorithm>
#include <cstdint>

namespace tetap::doctor {

enum class ClockSource : std::uint8_t { kLog, kEpochs, kSync };

class BusTime {
 public:
  BusTime() = default;
  BusTime(ClockSource source, std::uint32_t base, bool lockstep) : source_(source), base_(base), lockstep_(lockstep) {}

  /// Takes every frame of the log, in order.
  void add(base::Micros log_time, const base::CanFrame& frame) {
    log_now_ = log_time;
    const auto offset = sim::offset_in_block(frame, base_);
    if (!offset) return;
    if (source_ == ClockSource::kSync && *offset == bus::InSync::kOffset) {
      const auto sync = bus::decode<bus::InSync>(bus::payload(frame));
      if (sync) set(static_cast<std::int64_t>(sync->time_us));
    } else if (source_ == ClockSource::kEpochs && *offset == bus::EstEpoch::kOffset) {
      const auto epoch = bus::decode<bus::EstEpoch>(bus::payload(frame));
      if (epoch) set(static_cast<std::int64_t>(epoch->time_us));
    }
  }
  /// False before the first In_Sync or epoch.
  [[nodiscard]] bool known() const { return source_ == ClockSource::kLog || set_; }
  [[nodiscard]] base::Micros now() const {
    if (source_ == ClockSource::kLog) return log_now_;
    if (!set_) return {};
    const std::int64_t since = std::max<std::int64_t>(0, log_now_.us - log_at_.us);
    return base::Micros{bus_at_.us + (lockstep_ ? std::min<std::int64_t>(since, kTick_us) : since)};
  }
  [[nodiscard]] ClockSource source() const { return source_; }

 private:
  static constexpr std::int64_t kTick_us = 10'000;
  void set(std::int64_t us) {
    bus_at_ = base::Micros{us};
    log_at_ = log_now_;
    set_ = true;
  }

  ClockSource source_ = ClockSource::kLog;
  std::uint32_t base_ = 0x300;
  bool lockstep_ = false;  ///< Step frames: the log's clock is another one
  bool set_ = false;
  base::Micros log_now_, bus_at_, log_at_;
};

}  // namespace tetap::doctor
