// SPDX-License-Identifier: Apache-2.0
// Inertial navigation, part: the present, from the far end of the window over what it holds; and what of that end's
// work waits for the next tick.
#pragma once

#include "estimators/inertial/inertial.hpp"

namespace tetap::estimators {

/// In IMU samples: what is switched off or only gathered costs nothing.
inline std::int32_t Inertial::work_of(const sensor::Sample& sample, const Context& ctx) const {
  if (sample.sensor == sensor::Sensor::kImu) return 1;
  bool free = false;
  switch (sample.sensor) {
    case sensor::Sensor::kGnssPosition:
      return kMeasurement + kOfAFix;
    case sensor::Sensor::kWheelCounts:
      free = counts_soon(sample.stamp, ctx);
      break;
    case sensor::Sensor::kWheelSpeed:
    case sensor::Sensor::kBodySpeed:
      free = speed_soon(sample.stamp, ctx);
      break;
    case sensor::Sensor::kMagnetometer:
      free = ctx.parameters.magnetic.use == 0;
      break;
    case sensor::Sensor::kBarometer:
      free = ctx.parameters.baro.use == 0;
      break;
    default:
      break;
  }
  return free ? 0 : kMeasurement;
}

/// From the last that was published before it began anew, see begin_anew().
[[gnu::noinline]] inline void Inertial::measure_step(const nav::InsState& next) {
  const nav::InsState& last = ahead_.present();
  jump_.east_m = nav::difference(next.x, last.x);
  jump_.north_m = nav::difference(next.y, last.y);
  jump_.up_m = nav::difference(next.z, last.z);
  jump_.yaw_rad = base::wrap_angle(nav::euler(next.q_nb).yaw_rad - nav::euler(last.q_nb).yaw_rad);
}

/// Whether the sample asks for more than this tick has left.
inline bool Inertial::rests(const sensor::Sample& sample, const Context& ctx) {
  if (phase_ != Phase::kTracking || work_left_ >= work_of(sample, ctx)) return false;
  waits_ = true;
  return true;
}

template <class Window>
void Inertial::advance(base::Micros t, const Context& ctx, const Window& window) {
  const param::InertialParameters& n = ctx.parameters.inertial;
  now_ = t;
  const base::Micros due = t - base::Micros{ctx.parameters.loop.window_us};
  work_left_ = arrived_;
  arrived_ = 0;
  if (phase_ != Phase::kTracking) return ahead_.watch(window, n);
  // Where nothing comes any more that the filter could still fuse: up to there it goes without.
  base::Micros far = due - base::Micros{ctx.parameters.loop.period_us};
  if (window.size() > 0) {
    const sensor::Sample& next = window[0];
    const base::Micros begin = next.stamp - base::Micros{is_of(next, n) ? next.payload.imu.interval_us : 0};
    if (begin < far) far = begin;
  }
  if (far > time_ && (imu_.stuck() || unusable_ || imu_.stale(far, n))) {
    bridge(far - time_, ctx);
    stand(time_, ctx);
  }
  const OutputPredictor::With how{
      .parameters = n, .earth = ins_.earth, .turn_known = turn_known(time_), .wheel_turn_radps = wheel_turn_radps_};
  // Intervals need not add up to the stamps, so even what nothing corrects is not carried on for ever.
  constexpr base::Micros kLongest{500'000};
  if (t - anew_at_ >= kLongest) corrected();
  constexpr std::uint8_t kPatience = 3;
  anew_ = corrected_ > kPatience || (corrected_ > 0 && !waits_);
  waits_ = one_by_one_ = false;
  if (anew_) {
    corrected_ = 0;
    anew_at_ = t;
    one_by_one_ = ahead_.carry_from(
        {.x = ins_.x, .reached = time_, .last = imu_.heard(), .repeats = imu_.repeats(), .rate_b_radps = rate_b_radps_},
        window, how);
    // Then the far end leaves one of its own for later.
    if (one_by_one_ && work_left_ > 1) --work_left_;
  } else {
    if (corrected_ > 0) ++corrected_;
    work_left_ += kMeasurement + 1;
    ahead_.carry_on(window, how);
  }
  // The farther behind, the more.
  constexpr base::Micros kBehind{60'000};
  if (window.size() > 0 && due - window[0].stamp > kBehind) {
    const std::int64_t more = 1 + ((due - window[0].stamp - kBehind).us >> 14);
    work_left_ += kMeasurement * static_cast<std::int32_t>(more < 20 ? more : 20);
  }
  if (!base::is_finite(jump_.yaw_rad)) measure_step(ahead_.at(t, how));
  ahead_.reach(t, how);
  blind_ = unusable_ || t - ahead_.place().last > base::Micros{n.stale_us};
}

}  // namespace tetap::estimators
