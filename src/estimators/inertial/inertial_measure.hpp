// SPDX-License-Identifier: Apache-2.0
// Inertial navigation, part: one measurement through its gate, and what follows from being refused for long.
#pragma once

#include "estimators/inertial/inertial.hpp"

namespace tetap::estimators {

template <class Model>
Innovation Inertial::measure(const Model& model, Source source, float gate_scale, base::Micros stamp,
                             const Context& ctx) {
  const auto result = update(model, gate_scale * filter::chi_square_99(Model::kDimension));
  if (result.verdict > filter::Verdict::kRejected) return record(result);
  const bool rejected = result.verdict == filter::Verdict::kRejected;
  refused_or_not(source, rejected, stamp);
  const Refused& refused = refused_[source];
  if (rejected && refused.in_a_row >= ctx.parameters.recovery.at_least &&
      stamp - refused.since >= base::Micros{ctx.parameters.recovery.after_us})
    recover(result.nu, source, ctx.parameters);
  // Neither velocity nor place nor wheels, whatever it doubts: what it is wrong about is more than that.
  constexpr std::uint8_t kPatience = 3;
  if (recoveries_ >= kPatience && refused_[kPosition].in_a_row >= ctx.parameters.recovery.at_least &&
      !wheels_agree(stamp, ctx))
    begin_anew(stamp, sensor::ResetCause::kDiverged, ctx);
  return record(result);
}

inline void Inertial::refused_or_not(Source source, bool refused, base::Micros stamp) {
  Refused& r = refused_[source];
  if (!refused) {
    r.in_a_row = 0;
  } else if (r.in_a_row++ == 0) {
    r.since = stamp;
  }
}

/// What was refused that long is right and the filter wrong, or the filter will refuse it again: its doubts grow by
/// what it was off.
template <int M>
void Inertial::recover(const filter::Vector<float, M>& nu, Source source, const param::Parameters& n) {
  if constexpr (M == 3) {
    if (source == kVelocity) {
      if (refused_[kPosition].in_a_row == 0) {
        recoveries_ = 0;
      } else if (recoveries_ < 255) {
        ++recoveries_;
      }
      // What keeps pulling it away is gravity, taken for motion: it knows its tilt no better than at the start.
      const float tilt = n.inertial.start_tilt_rad, bias = n.inertial.accel_turn_on_mps2;
      for (int i = 0; i < 3; ++i) {
        ins_.p(3 + i, 3 + i) += nu(i) * nu(i);
        ins_.p(9 + i, 9 + i) += bias * bias;
        if (i < 2) ins_.p(6 + i, 6 + i) += tilt * tilt;
      }
    }
  }
  for (int i = 3; i < 6; ++i) ins_.p(i, i) += 0.25F;
  ins_.p(8, 8) += n.recovery.inflate_yaw_rad * n.recovery.inflate_yaw_rad;
  refused_[source] = {};
}

}  // namespace tetap::estimators
