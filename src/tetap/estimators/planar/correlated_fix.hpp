// SPDX-License-Identifier: Apache-2.0
// A GNSS fix whose error lasts. The gate judges the fix by its own sigma. The update uses a larger one, for the part
// that repeats the fix before.
#pragma once

#include "tetap/base/math.hpp"
#include "tetap/checks/coloured_noise.hpp"
#include "tetap/filter/update.hpp"
#include "tetap/model/gnss_position.hpp"

namespace tetap::estimators {

/// Update by a fix `since_s` after the one before (infinity: there was none). `gate`: the largest NIS that is accepted.
/// `correlation_s` 0: errors are white. The innovation is that of the fix by its own sigma.
template <class Filter>
filter::Innovation<float, 2> update_by_fix(Filter& filter, const model::GnssPosition& fix, float gate, float since_s,
                                           float correlation_s) {
  if (!(correlation_s > 0.0F)) return filter.update(fix, gate);
  Filter judge = filter;
  auto judged = judge.update(fix, gate);
  if (judged.verdict != filter::Verdict::kAccepted) return judged;
  model::GnssPosition weighed = fix;
  weighed.sigma_m *= base::sqrt(checks::kColouredNoiseInflation * checks::repeated(since_s, correlation_s));
  static_cast<void>(filter.update(weighed, base::kInfinity));
  return judged;
}

}  // namespace tetap::estimators
