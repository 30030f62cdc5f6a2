// SPDX-License-Identifier: Apache-2.0
// Keeps a covariance among the matrices that float can hold as positive definite: rounding in a very sharp measurement,
// or noise of one direction that is far above what was there, would take the smallest eigenvalue below zero.
#pragma once

#include "filter/symmetric.hpp"

namespace tetap::filter {

/// The least eigenvalue that the correlations may have: some thirty roundings. Less is no different from zero.
inline constexpr float kLeastEigenvalue = 2e-6F;

/// P less that share of its diagonal has a factor U^T D U. (That it has one is exact for a matrix next to P, by some
/// roundings: Higham 2002, thm. 10.3. The size of a pivot alone would prove little.) False for NaN and for a variance
/// that is zero or below.
template <class Scalar, int N>
[[nodiscard]] constexpr bool well_conditioned(const Symmetric<Scalar, N>& p) {
  Symmetric<Scalar, N> u;  // the diagonal holds 1 / pivot
#pragma GCC unroll 16
  for (int j = 0; j < N; ++j) {
    Scalar pivot = p(j, j) * Scalar(1.0F - kLeastEigenvalue);
#pragma GCC unroll 16
    for (int i = 0; i < j; ++i) {
      Scalar sum = p(i, j);
#pragma GCC unroll 16
      for (int k = 0; k < i; ++k) sum -= u(k, i) * u(k, k) * u(k, j);
      u(i, j) = sum;
      pivot -= sum * sum * u(i, i);
    }
    if (!(pivot > Scalar{0})) return false;
    u(j, j) = Scalar{1} / pivot;
  }
  return true;
}

/// Makes all correlations smaller by a little, which adds that share to every conditional variance; by more if that is
/// not enough, and in the end by all. Every entry has to be a number (Symmetric::bounded()).
template <class Scalar, int N>
[[gnu::noinline]] void restore(Symmetric<Scalar, N>& p) {
  constexpr auto kLeast = Scalar(1e-20F);  // below, products of variances leave the normal numbers
  for (int i = 0; i < N; ++i)
    if (!(p(i, i) > kLeast)) p(i, i) = kLeast;
  for (auto share = Scalar(4e-6F); !well_conditioned(p); share *= Scalar{10}) {
    const Scalar keep = share < Scalar{1} ? Scalar{1} - share : Scalar{0};
    for (int c = 0; c < N; ++c)
      for (int r = 0; r < c; ++r) p(r, c) *= keep;
    if (!(keep > Scalar{0})) return;
  }
}

}  // namespace tetap::filter
