// SPDX-License-Identifier: Apache-2.0
// Refusals of a source by its innovation gate, and when the filter has to give way.
#pragma once

#include "checks/persistence.hpp"
#include "estimators/inertial/filter_view.hpp"
#include "estimators/inertial/source.hpp"
#include "estimators/inertial/vote.hpp"

namespace tetap::estimators {

/// Counts refusals of a source in a row; once they persist, the source is right and the filter has to give way.
inline void count_refusal(checks::Persistence& refused, Assessment& a, Action give_way, const FilterView& filter) {
  const bool rejected = a.action == Action::kReject;
  refused.update(rejected, filter.stamp());
  if (!rejected) return;
  const param::RecoveryParameters& n = filter.parameters().recovery;
  if (!refused.persists(filter.stamp(), base::Micros{n.after_us}, n.at_least)) return;
  a.action = give_way;
  refused.reset();
}

/// The filter is wrong by `innovation`, as a device shows: it is widened by the causes.
inline void give_way(Assessment& a, Action action, const nav::Vector3& innovation, Witness& witness,
                     base::Micros stamp) {
  a.action = action;
  a.remedy.innovation = innovation;
  a.remedy.since_s = witness.disagrees_s(stamp);
  witness.forgive();
}

/// A refused velocity of a device: the others vote. `speed`: the vote of the other velocity.
inline void judge_velocity(Assessment& a, const nav::Vector3& nu_n_mps, Vote speed, Witness& witness,
                           const FilterView& filter) {
  const Ballot votes{.speed = speed,
                     .fixes = filter.fixes_vote(witness.since(filter.stamp()), nu_n_mps),
                     .speeds_agree = filter.speeds_agree()};
  if (gives_way(witness.refused(), votes, filter.stamp(), filter.parameters().recovery))
    give_way(a, Action::kWidenVelocity, nu_n_mps, witness, filter.stamp());
}

/// Status of a source that its innovation gate alone refuses.
[[nodiscard]] inline SourceStatus status_of(const checks::Persistence& refused) {
  return refused.holds() ? SourceStatus{SourceState::kRejecting, Check::kGate}
                         : SourceStatus{SourceState::kFusing, Check::kNone};
}

}  // namespace tetap::estimators
