// SPDX-License-Identifier: Apache-2.0
// The covariance of a filter in one form, whether the filter holds P or a triangular root of it.
#pragma once

#include "tetap/filter/symmetric.hpp"

#include <array>
#include <cstddef>

namespace tetap::filter {

template <class F>
concept HoldsCovariance = requires(const F& filter) {
  filter.p.packed();
};
template <class F>
concept HoldsRoot = requires(const F& filter) {
  filter.root.packed();
  filter.covariance();
};

template <HoldsCovariance F>
[[nodiscard]] const auto& covariance_of(const F& filter) {
  return filter.p;
}
template <HoldsRoot F>
[[nodiscard]] auto covariance_of(const F& filter) {
  return filter.covariance();
}

template <HoldsCovariance F>
void set_covariance(F& filter, const Symmetric<typename F::Scalar, F::kErrors>& p) {
  filter.p = p;
}
template <HoldsRoot F>
void set_covariance(F& filter, const Symmetric<typename F::Scalar, F::kErrors>& p) {
  filter.set_covariance(p);
}

/// Adds independent variances to the error states.
template <class F>
void add_variance(F& filter, const std::array<typename F::Scalar, static_cast<std::size_t>(F::kErrors)>& variance) {
  Symmetric<typename F::Scalar, F::kErrors> p = covariance_of(filter);
  p.add_diagonal(variance);
  set_covariance(filter, p);
}

/// Feeds the numbers that the filter holds of its covariance to the sink.
template <class F, class Sink>
void hash_covariance(const F& filter, Sink&& sink) {
  if constexpr (HoldsCovariance<F>) {
    for (const typename F::Scalar v : filter.p.packed()) sink(v);
  } else {
    for (const typename F::Scalar v : filter.root.packed()) sink(v);
  }
}

}  // namespace tetap::filter
