// SPDX-License-Identifier: Apache-2.0
// Records of measurements that wait for their frame: at most one goes out in so many ticks. Within a tick they come in
// the order of the samples. Records refused between ticks are put in that order here, so that no arrival leaves a
// trace.
#pragma once

#include "tetap/base/float_bits.hpp"
#include "tetap/base/members.hpp"
#include "tetap/bus/counters.hpp"
#include "tetap/estimators/estimate.hpp"
#include "tetap/sensor/sample.hpp"

#include <array>
#include <cstddef>
#include <cstdint>

namespace tetap::bus {

class EventQueue {
 public:
  void power_on() { size_ = first_ = 0; }
  void tick_begins() {
    first_ = kNone;
    ++tick_;
  }
  void tick_ends() { first_ = size_; }

  /// In a full queue an accepted record makes room for a refused one; without one the last refused has no room.
  void add(const estimators::Innovation& innovation, const sensor::Sample& sample, std::size_t instance,
           base::Micros now, Counters& counters);

  [[nodiscard]] bool empty() const { return size_ == 0; }
  /// The oldest, its age counted to this tick; not empty.
  [[nodiscard]] bus::EstInnov take(std::int32_t period_us) {
    bus::EstInnov first = queue_[0];
    remove(0);
    const auto waited = static_cast<std::uint8_t>(tick_ - first.epoch);
    first.age_s += base::seconds(base::Micros{std::int64_t{waited} * period_us});
    return first;
  }
  static constexpr auto members(auto& self) {
    return base::members(base::first(self.queue_, self.size_), base::count(self.size_), self.tick_,
                         base::count(self.first_));
  }

 private:
  static constexpr std::size_t kCapacity = 16, kNone = kCapacity + 1;
  /// By the time at which they were true; the rest only makes it an order.
  [[nodiscard]] static bool before(const bus::EstInnov& a, const bus::EstInnov& b) {
    if (a.age_s > b.age_s || a.age_s < b.age_s) return a.age_s > b.age_s;
    return a.sensor != b.sensor ? a.sensor < b.sensor : a.inst < b.inst;
  }
  void remove(std::size_t i) {
    for (++i; i < size_; ++i) queue_[i - 1] = queue_[i];
    --size_;
  }

  std::array<bus::EstInnov, kCapacity> queue_{};
  std::size_t size_ = 0;
  std::uint8_t tick_ = 0;  ///< number of the last tick; a record in the queue has its own tick in `epoch`
  std::size_t first_ = 0;  ///< begin of the ordered events since the last tick; within a tick there are none
};

/// Statistic of the test that decided, over its limit: of the failed check, else of the innovation gate.
[[nodiscard]] constexpr float ratio_of(const estimators::Innovation& innovation) {
  if (innovation.limit > 0.0F) return innovation.statistic / innovation.limit;
  return innovation.gate > 0.0F ? innovation.nis / innovation.gate : base::kNan;
}

inline void EventQueue::add(const estimators::Innovation& innovation, const sensor::Sample& sample,
                            std::size_t instance, base::Micros now, Counters& counters) {
  const bus::EstInnov message{.estimator = static_cast<std::uint8_t>(instance),
                              .sensor = sample.sensor,
                              .inst = sample.instance,
                              .verdict = innovation.verdict,
                              .dof = innovation.dof,
                              .age_s = base::seconds(now - sample.stamp),
                              .nis = innovation.dof > 0 ? innovation.nis : base::kNan,
                              .ratio = ratio_of(innovation),
                              .id = innovation.landmark,
                              .check = innovation.failed,
                              .epoch = tick_};
  if (size_ == kCapacity) {
    ++counters.events_dropped;
    if (innovation.verdict == sensor::Verdict::kAccepted) return;
    std::size_t victim = 0;
    while (victim < size_ && queue_[victim].verdict != sensor::Verdict::kAccepted) ++victim;
    if (victim < size_) {
      if (victim < first_ && first_ != kNone) --first_;
    } else if (first_ < size_ && before(message, queue_[size_ - 1])) {
      victim = size_ - 1;
    } else {
      return;
    }
    remove(victim);
  }
  std::size_t at = size_++;
  for (; at > first_ && before(message, queue_[at - 1]); --at) queue_[at] = queue_[at - 1];
  queue_[at] = message;
  if (size_ > counters.events_high_water) counters.events_high_water = static_cast<std::uint16_t>(size_);
}

}  // namespace tetap::bus
