// SPDX-License-Identifier: Apache-2.0
// Records of measurements that wait for their frame: at most one goes out in so many ticks.
#pragma once

#include "app/estimate.hpp"
#include "app/health.hpp"
#include "app/sample.hpp"
#include "base/float_bits.hpp"

#include <array>
#include <cstddef>
#include <cstdint>

namespace tetap::app {

class EventQueue {
 public:
  void power_on() { size_ = 0; }

  /// When the queue is full an accepted one makes room for one that was not.
  void add(const Innovation& innovation, const Sample& sample, std::size_t instance, base::Micros now,
           Counters& counters);

  [[nodiscard]] bool empty() const { return size_ == 0; }
  /// The oldest; not empty.
  [[nodiscard]] can::EstInnov take() {
    const can::EstInnov first = queue_[0];
    for (std::size_t i = 1; i < size_; ++i) queue_[i - 1] = queue_[i];
    --size_;
    return first;
  }

 private:
  std::array<can::EstInnov, 16> queue_{};
  std::size_t size_ = 0;
};

inline void EventQueue::add(const Innovation& innovation, const Sample& sample, std::size_t instance, base::Micros now,
                            Counters& counters) {
  const can::EstInnov message{.estimator = static_cast<std::uint8_t>(instance),
                              .sensor = sample.sensor,
                              .inst = sample.instance,
                              .verdict = innovation.verdict,
                              .dof = innovation.dof,
                              .age_ms = static_cast<float>(base::seconds(now - sample.stamp) * 1000.0F),
                              .nis = innovation.dof > 0 ? innovation.nis : base::kNan,
                              .ratio = innovation.gate > 0.0F ? innovation.nis / innovation.gate : base::kNan,
                              .id = innovation.landmark,
                              .epoch = 0};
  if (size_ == queue_.size()) {
    ++counters.events_dropped;
    if (innovation.verdict == can::Verdict::kAccepted) return;
    std::size_t victim = 0;
    while (victim < size_ && queue_[victim].verdict != can::Verdict::kAccepted) ++victim;
    if (victim == size_) return;
    for (std::size_t i = victim + 1; i < size_; ++i) queue_[i - 1] = queue_[i];
    --size_;
  }
  queue_[size_++] = message;
  if (size_ > counters.events_high_water) counters.events_high_water = static_cast<std::uint16_t>(size_);
}

}  // namespace tetap::app
