// SPDX-License-Identifier: Apache-2.0
// Inertial navigation: wheels, speedometer, and the non-holonomic constraint.
#include "tetap/estimators/inertial/inertial.hpp"
#include "tetap/estimators/inertial/measure.hpp"

namespace tetap::estimators {

template <class Watch>
Innovation InertialWith<Watch>::fuse(const sensor::WheelCounts& counts, base::Micros stamp, const Context& ctx) {
  EncoderInterval& encoders = sources_.wheels.encoders();
  if (skips_counts(stamp, ctx.parameters.inertial)) {
    encoders.skip(counts, stamp, ctx.parameters);
    return {.verdict = sensor::Verdict::kAccepted};
  }
  const FilterView filter = view(stamp, ctx);
  const std::optional<WheelReading> reading = encoders.update(counts, filter);
  return reading ? fuse_wheels(*reading, filter) : Innovation{.verdict = sensor::Verdict::kAccepted};
}

template <class Watch>
Innovation InertialWith<Watch>::fuse(const sensor::WheelSpeeds& speeds, base::Micros stamp, const Context& ctx) {
  if (skips_speed(stamp, ctx.parameters.inertial)) return {.verdict = sensor::Verdict::kAccepted};
  return fuse_wheels({.wheels = {.left_mps = speeds.left_mps, .right_mps = speeds.right_mps}}, view(stamp, ctx));
}

/// There are no wheels to compare: the innovation gate alone judges a speedometer.
template <class Watch>
Innovation InertialWith<Watch>::fuse(const sensor::BodySpeed& speed, base::Micros stamp, const Context& ctx) {
  if (skips_speed(stamp, ctx.parameters.inertial)) return {.verdict = sensor::Verdict::kAccepted};
  sources_.forward.note(speed.forward_mps, stamp);
  return fuse_forward({.mps = speed.forward_mps}, view(stamp, ctx));
}

/// Its own frame, which is gone when the forward speed is fused: that path decides the stack.
template <class Watch>
[[gnu::noinline]] Innovation InertialWith<Watch>::assess_wheels(const WheelReading& reading, const FilterView& filter,
                                                                ForwardReading& forward) {
  if (sources_.wheels.leapt(filter.stamp())) return {.verdict = sensor::Verdict::kRejected, .failed = Check::kValue};
  sources_.forward.note(reading.mean_mps(), filter.stamp());
  Assessment a = sources_.wheels.assess(reading, filter);
  const bool at_rest = sources_.wheels.slip() == Wheels::Slip::kTurn;
  if (a.remedy.sigma_rad > 0.0F) {
    predict_covariance();
    Recovery::widen_turn(ins_, a.remedy.sigma_rad, at_rest);
  }
  if (a.fuses()) {
    forward = sources_.wheels.forward(reading, filter);
    return {.verdict = sensor::Verdict::kAccepted};
  }
  if (sources_.wheels.slip() == Wheels::Slip::kBoth) {
    a = sources_.forward.assess_spinning(reading.mean_mps(), filter);
    apply(a, filter);
  }
  return record_of(a);
}

template <class Watch>
Innovation InertialWith<Watch>::fuse_wheels(const WheelReading& reading, const FilterView& filter) {
  ForwardReading forward;
  const Innovation assessed = assess_wheels(reading, filter, forward);
  if (assessed.verdict != sensor::Verdict::kAccepted) return assessed;
  return fuse_forward(forward, filter);
}

template <class Watch>
[[gnu::noinline]] Innovation InertialWith<Watch>::fuse_forward(const ForwardReading& reading,
                                                               const FilterView& filter) {
  const param::InertialParameters& n = filter.parameters().inertial;
  if (!tracking()) {
    alignment_.forward(reading.mps, n.wheel_mps + n.slip_share * base::abs(reading.mps), n.axle_x_b_m,
                       heading_monitor_);
    return {.verdict = sensor::Verdict::kAccepted};
  }
  static_cast<void>(sources_.forward.assess(reading, filter));
  return measure(ForwardSpeedSource::model(reading, filter), sources_.forward, n.wheel_gate_scale, filter);
}

/// The constraint alone, where no speed came of late: it is what a speed of which nothing is known leaves.
template <class Watch>
void InertialWith<Watch>::fuse_constraint(base::Micros stamp, const Context& ctx) {
  const base::Micros every{ctx.parameters.inertial.constrain_every_us}, last = sources_.forward.fused_at();
  if (every.us <= 0 || checks::recent(last, stamp, every) || standstill_.pending() ||
      !budget_.allows_due(stamp - last, every))
    return;
  const FilterView filter = view(stamp, ctx);
  if (!sources_.forward.starting_conditions(filter)) return;
  const DeviceRecord before = sources_.forward.witness();
  static_cast<void>(fuse_forward({.sigma_mps = ForwardReading::kUnknown_mps}, filter));
  sources_.forward.restore(before, filter.slip() == Wheels::Slip::kBoth);
}

}  // namespace tetap::estimators
