// SPDX-License-Identifier: Apache-2.0
// The covariance of any filter: some keep P as a member, others as factors behind functions.
#pragma once

#include "tetap/filter/symmetric.hpp"

namespace tetap {

template <class Filter, int N>
void set_covariance(Filter& filter, const filter::Symmetric<typename Filter::Scalar, N>& p) {
  if constexpr (requires { filter.set_covariance(p); }) {
    filter.set_covariance(p);
  } else {
    filter.p = p;
  }
}
template <class Filter>
auto covariance(const Filter& filter) {
  if constexpr (requires { filter.covariance(); }) {
    return filter.covariance();
  } else {
    return filter.p;
  }
}

}  // namespace tetap
