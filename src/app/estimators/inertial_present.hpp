// SPDX-License-Identifier: Apache-2.0
// Inertial navigation, part: the present, from the far end of the window over what it holds; and what of that end's
// work waits for the next tick.
#pragma once

#include "app/estimators/inertial.hpp"

namespace tetap::app {

/// In IMU samples.
inline std::int32_t Inertial::work_of(const Sample& sample, const Context& with) const {
  if (sample.sensor == can::Sensor::kImu) return 1;
  return sample.sensor == can::Sensor::kWheelCounts && gathers(sample.stamp, with) ? 0 : kMeasurement;
}

/// Whether the sample asks for more than this tick has left.
inline bool Inertial::rests(const Sample& sample, const Context& with) const {
  return phase_ == Phase::kTracking && work_left_ < work_of(sample, with);
}

template <class Window>
void Inertial::advance(base::Micros t, const Context& with, const Window& window) {
  const InertialNumbers& n = with.numbers.inertial;
  now_ = t;
  const base::Micros due = t - base::Micros{with.numbers.loop.window_us};
  work_left_ = arrived_ + 1;
  arrived_ = 0;
  if (phase_ != Phase::kTracking) return ahead_.watch(window, n);
  // Where nothing comes any more that the filter could still fuse: up to there it goes without.
  const base::Micros far = due - base::Micros{with.numbers.loop.period_us};
  const bool all = window.size() == 0 || window[0].stamp > far;
  if (all && far > time_ && (imu_.stuck() || unusable_ || imu_.stale(far, n))) {
    bridge(far - time_, with);
    stand(time_, with);
  }
  const Ahead::With how{
      .numbers = n, .earth = ins_.earth, .turn_known = turn_known(time_), .wheel_turn_radps = wheel_turn_radps_};
  constexpr std::uint8_t kPatience = 3;
  bool waiting = false;
  for (std::size_t i = 0; corrected_ > 0 && i < window.size(); ++i) {
    const Sample& sample = window[i];
    if (sample.stamp > due) break;
    waiting = waiting || work_of(sample, with) >= kMeasurement;
  }
  anew_ = corrected_ > kPatience || (corrected_ > 0 && !waiting);
  if (anew_) {
    corrected_ = 0;
    ahead_.carry_from(
        {.x = ins_.x, .reached = time_, .last = imu_.heard(), .repeats = imu_.repeats(), .rate_b_radps = rate_b_radps_},
        window, how);
  } else {
    if (corrected_ > 0) ++corrected_;
    work_left_ += kMeasurement;
    ahead_.carry_on(window, how);
  }
  constexpr base::Micros kMostBehind{60'000};
  if (window.size() > 0 && due - window[0].stamp > kMostBehind) work_left_ += kMeasurement;
  present_ = ahead_.at(t, how);
  blind_ = unusable_ || t - ahead_.place().last > base::Micros{n.stale_us};
}

}  // namespace tetap::app
