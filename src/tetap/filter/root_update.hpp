// SPDX-License-Identifier: Apache-2.0
// The gate and the record of a correction in square-root form.
#pragma once

#include "tetap/filter/triangular.hpp"
#include "tetap/filter/update.hpp"

namespace tetap::filter {

/// Implements docs/explanation/kalman_forms.md (9).
/// Gate first; `root` becomes the root of P+ only when the verdict is kAccepted.
template <class Scalar, int N, int M>
[[nodiscard, gnu::always_inline]] inline Update<Scalar, N, M> root_update(Triangular<Scalar, N>& root,
                                                                          const Triangular<Scalar, M>& e,
                                                                          const Matrix<Scalar, N, M>& slope,
                                                                          const Vector<Scalar, M>& nu, Scalar gate) {
  Update<Scalar, N, M> result;
  Innovation<Scalar, M>& record = result.innovation;
  const RootCorrection<Scalar, N, M> by(root, e, slope);
  record.nu = nu;
  record.s = by.s.covariance();
  record.gate = gate;
  if (!record.s.bounded()) return result;
  if (!by.s.regular()) {
    record.verdict = Verdict::kSingular;
    return result;
  }
  const Vector<Scalar, M> y = by.whitened(nu);
  record.nis = y.dot(y);
  if (!(record.nis < Scalar(1e30F))) return result;
  if (!by.root.regular()) {  // a state would be known without an error
    record.verdict = Verdict::kSingular;
    return result;
  }
  if (!(record.nis <= gate)) {
    record.verdict = Verdict::kRejected;
    return result;
  }
  record.verdict = Verdict::kAccepted;
  unroll<0, N>([&](auto n) __attribute__((always_inline)) {
    Scalar sum = by.gain(0, int{n}) * y(0);
    unroll<1, M>([&](auto m) __attribute__((always_inline)) { sum += by.gain(int{m}, int{n}) * y(int{m}); });
    result.dx(int{n}) = sum;
  });
  root = by.root;
  return result;
}

}  // namespace tetap::filter
