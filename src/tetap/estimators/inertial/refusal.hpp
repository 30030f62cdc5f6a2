// SPDX-License-Identifier: Apache-2.0
// Refusals of a source by its innovation gate, and when the filter has to give way.
#pragma once

#include "tetap/checks/persistence.hpp"
#include "tetap/estimators/inertial/filter_view.hpp"
#include "tetap/estimators/inertial/source.hpp"
#include "tetap/estimators/inertial/vote.hpp"

namespace tetap::estimators {

/// Counts refusals of a source in a row; once they persist, the source is right and the filter has to give way.
inline void count_refusal(checks::Persistence& refused, Assessment& a, Action widen_by_innovation,
                          const FilterView& filter) {
  const bool rejected = a.action == Action::kReject;
  refused.update(rejected, filter.stamp());
  if (!rejected) return;
  const param::RecoveryParameters& n = filter.parameters().recovery;
  if (!refused.persists(filter.stamp(), base::Micros{n.after_us}, n.at_least)) return;
  a.action = widen_by_innovation;
  refused.reset();
}

/// The filter is wrong by `innovation`, as a device shows: it is widened by the causes.
inline void widen_by_innovation(Assessment& a, Action action, const nav::Vector3& innovation, DeviceRecord& witness,
                                base::Micros stamp) {
  a.action = action;
  a.remedy.innovation = innovation;
  a.remedy.since_s = witness.disagreement_s(stamp);
  witness.reset_refusals();
}

/// A refused velocity of a device: the others vote. `speed`: the vote of the other velocity.
inline void judge_velocity(Assessment& a, const nav::Vector3& nu_n_mps, Vote speed, Vote fixes, DeviceRecord& witness,
                           const FilterView& filter) {
  const Votes votes{.speed = speed, .fixes = fixes, .speeds_agree = filter.speeds_agree()};
  if (filter_yields(witness.refused(), votes, filter.stamp(), filter.parameters().recovery))
    widen_by_innovation(a, Action::kWidenVelocity, nu_n_mps, witness, filter.stamp());
}

/// Status of a source that its innovation gate alone refuses.
[[nodiscard]] inline SourceStatus status_of(const checks::Persistence& refused) {
  return refused.holds() ? SourceStatus{SourceState::kRejecting, Check::kGate}
                         : SourceStatus{SourceState::kFusing, Check::kNone};
}

}  // namespace tetap::estimators
