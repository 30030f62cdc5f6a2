// SPDX-License-Identifier: Apache-2.0
// Refusals of a source by its innovation gate, and when the filter has to give way.
#pragma once

#include "checks/persistence.hpp"
#include "estimators/inertial/filter_view.hpp"
#include "estimators/inertial/source.hpp"

namespace tetap::estimators {

/// Counts refusals of a source in a row; once they persist, the source is right and the filter has to give way.
inline void count_refusal(checks::Persistence& refused, SourceStatus& status, Assessment& a, Action give_way,
                          const FilterView& filter) {
  const bool rejected = a.action == Action::kReject;
  refused.update(rejected, filter.stamp());
  if (!rejected) return status.fused();
  status.rejecting(a.failed);
  const param::RecoveryParameters& n = filter.parameters().recovery;
  if (!refused.persists(filter.stamp(), base::Micros{n.after_us}, n.at_least)) return;
  a.action = give_way;
  refused.reset();
}

}  // namespace tetap::estimators
