// SPDX-License-Identifier: Apache-2.0
// Inertial navigation: one measurement through its innovation gate, and what follows from refusing it for long.
#pragma once

#include "tetap/estimators/inertial/inertial.hpp"

namespace tetap::estimators {

template <class Watch>
template <class Model, class Source>
Innovation InertialWith<Watch>::measure(const Model& model, Source& source, float gate_scale,
                                        const FilterView& filter) {
  const auto result = update(model, gate_scale * filter::chi_square_99(Model::kDimension));
  if (result.verdict > filter::Verdict::kRejected) return record(result);
  return conclude(result, source, filter);
}

/// Its own frame, beside that of the update: the update decides the stack.
template <class Watch>
template <int M, class Source>
[[gnu::noinline]] Innovation InertialWith<Watch>::conclude(const filter::Innovation<float, M>& result, Source& source,
                                                           const FilterView& filter) {
  const bool rejected = result.verdict == filter::Verdict::kRejected;
  Assessment a{.dof = M, .nis = result.nis, .gate = result.gate};
  if (rejected) a.reject(Check::kGate);
  source.conclude(a, result.nu, filter);
  apply(a, filter);
  return record_of(a);
}

}  // namespace tetap::estimators
