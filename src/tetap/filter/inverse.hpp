// SPDX-License-Identifier: Apache-2.0
// Inverse and determinant of a positive definite matrix from its Cholesky factor (Golub & Van Loan 2013, sec. 4.2).
#pragma once

#include "tetap/filter/triangular.hpp"

namespace tetap::filter {

template <class Scalar, int N>
struct Inverse {
  Symmetric<Scalar, N> value;
  bool positive = false;  ///< the matrix was positive definite; else `value` means nothing
};

template <class Scalar, int N>
[[nodiscard]] Inverse<Scalar, N> inverse_of(const Symmetric<Scalar, N>& p) {
  const Triangular<Scalar, N> r = root_of(p);
  Inverse<Scalar, N> out;
  if (!r.regular()) return out;
  Triangular<Scalar, N> w;  // R^-1
  for (int c = 0; c < N; ++c) {
    w(c, c) = Scalar{1} / r(c, c);
    for (int i = c - 1; i >= 0; --i) {
      Scalar sum = 0;
      for (int k = i + 1; k <= c; ++k) sum += r(i, k) * w(k, c);
      w(i, c) = -sum / r(i, i);
    }
  }
  for (int c = 0; c < N; ++c)
    for (int i = 0; i <= c; ++i) {
      Scalar sum = 0;
      for (int k = c; k < N; ++k) sum += w(i, k) * w(c, k);
      out.value(i, c) = sum;
    }
  out.positive = true;
  return out;
}

/// log det P; minus infinity where P is not positive definite.
template <class Scalar, int N>
[[nodiscard]] Scalar log_determinant(const Symmetric<Scalar, N>& p) {
  const Triangular<Scalar, N> r = root_of(p);
  Scalar sum = 0;
  for (int i = 0; i < N; ++i) sum += base::log(r(i, i));
  return Scalar{2} * sum;
}

}  // namespace tetap::filter
