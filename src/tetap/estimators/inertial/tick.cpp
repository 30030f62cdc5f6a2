// SPDX-License-Identifier: Apache-2.0
// Inertial navigation: one tick. The present is predicted from the horizon, and the horizon's work is shared out.
#include "tetap/estimators/inertial/inertial.hpp"

namespace tetap::estimators {

/// In units of the work budget: samples that are switched off or only gathered cost nothing.
template <class Watch>
std::int32_t InertialWith<Watch>::work_of(const sensor::Sample& sample, const Context& ctx) const {
  const param::InertialParameters& n = ctx.parameters.inertial;
  bool free = false;
  switch (sample.sensor) {
    case sensor::Sensor::kImu:
      return WorkBudget::kImuSample;
    case sensor::Sensor::kGnssPosition:
      return WorkBudget::kMeasurement + WorkBudget::kFixChecks;
    case sensor::Sensor::kWheelCounts:
      free = skips_counts(sample.stamp, n);
      break;
    case sensor::Sensor::kWheelSpeed:
    case sensor::Sensor::kBodySpeed:
      free = skips_speed(sample.stamp, n);
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
  return free ? 0 : WorkBudget::kMeasurement;
}

template <class Watch>
bool InertialWith<Watch>::defers(const sensor::Sample& sample, const Context& ctx) {
  if (!tracking() || budget_.allows(work_of(sample, ctx))) return false;
  budget_.defer();
  return true;
}

/// Up to where no sample comes any more that the filter could fuse, it goes without IMU.
template <class Watch>
void InertialWith<Watch>::bridge_to(base::Micros horizon, const Context& ctx) {
  const bool missing =
      imu_.health().stuck() || imu_.unusable() || imu_.health().stale(horizon, ctx.parameters.inertial);
  if (horizon <= time_ || !missing) return;
  bridge(horizon - time_, ctx);
  detect_standstill(time_, ctx);
}

template <class Watch>
void InertialWith<Watch>::predict_output(const OutputPredictor::Inputs& in, const sensor::Window& window) {
  const bool rebuild = predictor_.schedule().begin_tick(predictor_.time(), budget_.deferred());
  budget_.clear_deferred();
  if (!rebuild) {
    budget_.grant(WorkBudget::kMeasurement + WorkBudget::kImuSample);
    return predictor_.extend(window, in);
  }
  OutputPredictor::Place far{.x = ins_.x,
                             .reached = time_,
                             .last = imu_.health().last_valid(),
                             .classifier = imu_.health().classifier(),
                             .rate_b_radps = imu_.rate_b_radps()};
  ImuPlace(in.parameters).to_imu(far.x, imu_.end_rate_b_radps() - far.x.b_g_radps);
  const bool samplewise = predictor_.rebuild(far, window, in);
  predictor_.schedule().note_samplewise(samplewise);
  // Then the horizon leaves half of its own samples for later.
  if (samplewise && budget_.left() > 1) budget_.spend(budget_.left() / 2);
}

template <class Watch>
void InertialWith<Watch>::advance(base::Micros t, const Context& ctx, const sensor::Window& window) {
  const param::InertialParameters& n = ctx.parameters.inertial;
  predictor_.begin_tick(t);
  const base::Micros due = t - base::Micros{ctx.parameters.loop.window_us};
  budget_.begin_tick();
  if (!tracking()) return predictor_.follow(window, n);
  base::Micros horizon = due - base::Micros{ctx.parameters.loop.period_us};
  if (window.size() > 0) {
    const sensor::Sample& next = window[0];
    const base::Micros begin = next.stamp - base::Micros{is_of(next, n) ? next.payload.imu.interval_us : 0};
    if (begin < horizon) horizon = begin;
  }
  bridge_to(horizon, ctx);
  const OutputPredictor::Inputs in{.parameters = n,
                                   .earth = ins_.earth,
                                   .turn_known = view(time_, ctx).wheels_show_turn(),
                                   .wheel_turn_radps = sources_.wheels.turn_radps(),
                                   .imu_distrusted = imu_.health().axis_stuck()};
  predict_output(in, window);
  // The farther the horizon is behind, the more work a tick takes.
  constexpr base::Micros kBehind{60'000};
  if (window.size() > 0 && due - window[0].stamp > kBehind) {
    const std::int64_t more = 1 + ((due - window[0].stamp - kBehind).us >> 14);
    budget_.grant(WorkBudget::kMeasurement * static_cast<std::int32_t>(more < 20 ? more : 20));
  }
  if (recovery_.step_unknown()) recovery_.measure_step(predictor_.present(), predictor_.at(t, in));
  predictor_.publish(in, imu_.unusable());
  watch_.publish(ins_.p);
}

}  // namespace tetap::estimators
