// SPDX-License-Identifier: Apache-2.0
// Refusals of a source by its innovation gate, and when the filter has to give way.
#pragma once

#include "checks/persistence.hpp"
#include "estimators/inertial/filter_view.hpp"
#include "estimators/inertial/source.hpp"

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

/// Status of a source that its innovation gate alone refuses.
[[nodiscard]] inline SourceStatus status_of(const checks::Persistence& refused) {
  return refused.holds() ? SourceStatus{SourceState::kRejecting, Check::kGate}
                         : SourceStatus{SourceState::kFusing, Check::kNone};
}

}  // namespace tetap::estimators
