// SPDX-License-Identifier: Apache-2.0
// Keeps a covariance among the matrices that float can hold as positive definite. Rounding in a very sharp measurement
// would take the smallest eigenvalue below zero. Noise of one direction that is far above what was there would do so,
// too.
#pragma once

#include "tetap/base/multiply_add.hpp"
#include "tetap/filter/symmetric.hpp"
#include "tetap/filter/unroll.hpp"

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

/// The same by a test that costs less and may refuse a P that is well conditioned. Three correlations have a trace of
/// 3: with the determinant d, the least eigenvalue is above d / 2.25. The product of the other two eigenvalues is at
/// most 2.25. Of any other number: the factor, with twice the share taken off.
template <class Scalar, int N>
[[nodiscard, gnu::always_inline]] inline bool surely_well_conditioned(const Symmetric<Scalar, N>& p) {
  if constexpr (N != 3) {
    Symmetric<Scalar, N> u;  // d(k) u(k, j) above the diagonal
    Vector<Scalar, N> inverse;
    bool fine = true;
    unroll<0, N>([&](auto j) __attribute__((always_inline)) {
      Scalar pivot = p(j, j) * Scalar(1.0F - 2 * kLeastEigenvalue);
      Vector<Scalar, N> l;
      unroll<0, j>([&](auto i) __attribute__((always_inline)) {
        Scalar sum = p(i, j);
        unroll<0, i>([&](auto k) __attribute__((always_inline)) {
          sum = base::subtract_product(sum, Scalar{l(int{k})}, u(k, i));
        });
        u(i, j) = sum;
        l(int{i}) = sum * inverse(int{i});
        pivot = base::subtract_product(pivot, Scalar{l(int{i})}, sum);
      });
      fine = fine && pivot > Scalar{0};
      if constexpr (j + 1 < N) inverse(int{j}) = Scalar{1} / pivot;
    });
    return fine;
  } else {
    constexpr auto kLeast = Scalar(16 * kLeastEigenvalue);
    const Scalar xx = p(0, 0), xy = p(0, 1), yy = p(1, 1), xz = p(0, 2), yz = p(1, 2), zz = p(2, 2);
    using base::add_product, base::subtract_product;
    const Scalar minor = subtract_product(xx * yy, xy, xy);
    const Scalar by_xz = subtract_product(xy * yz, yy, xz), by_yz = subtract_product(xx * yz, xy, xz);
    const Scalar determinant = subtract_product(add_product(zz * minor, xz, by_xz), yz, by_yz);
    return xx > Scalar{0} && minor > Scalar{0} && determinant > kLeast * (xx * yy * zz);
  }
}

/// Makes all correlations smaller by a little, which adds that share to every conditional variance. The share grows if
/// that is not enough, and in the end takes all. Every entry has to be a number (Symmetric::bounded()).
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
