// SPDX-License-Identifier: Apache-2.0
// P = R^T R, R upper triangular, in array form: predicted and corrected by rotations alone (Kailath, Sayed, Hassibi
// 2000, ch. 12; Kaminski, Bryson, Schmidt 1971).
#pragma once

#include "tetap/filter/kalman_form.hpp"
#include "tetap/filter/root_update.hpp"

namespace tetap::filter {

template <class Scalar, int N>
class SquareRoot {
 public:
  explicit SquareRoot(const Symmetric<Scalar, N>& p) : root_(root_of(p)) {}
  [[nodiscard]] Symmetric<Scalar, N> covariance() const { return root_.covariance(); }

  /// Implements docs/explanation/kalman_forms.md (8).
  /// Rows of R F^T join the root of Q. False where the result is not positive definite.
  bool propagate(const Matrix<Scalar, N, N>& f, const Symmetric<Scalar, N>& q) {
    Triangular<Scalar, N> next = root_of(q);
    for (int j = 0; j < N; ++j) {
      Vector<Scalar, N> row;
      for (int n = 0; n < N; ++n) {
        Scalar sum = 0;
        for (int c = j; c < N; ++c) sum += root_(j, c) * f(n, c);
        row(n) = sum;
      }
      next.absorb(row);
    }
    if (!next.regular()) return false;
    root_ = next;
    return true;
  }

  template <int M>
  [[nodiscard]] Update<Scalar, N, M> update(const Matrix<Scalar, M, N>& h, const Vector<Scalar, M>& nu,
                                            const Vector<Scalar, M>& noise, Scalar gate) {
    Triangular<Scalar, M> e;
    for (int m = 0; m < M; ++m) e(m, m) = base::sqrt(noise(m));
    Matrix<Scalar, N, M> slope;
    for (int j = 0; j < N; ++j)
      for (int m = 0; m < M; ++m) {
        Scalar sum = 0;
        for (int c = j; c < N; ++c) sum += root_(j, c) * h(m, c);
        slope(j, m) = sum;
      }
    return root_update<Scalar, N, M>(root_, e, slope, nu, gate);
  }

 private:
  Triangular<Scalar, N> root_;
};

template <State S>
using SquareRootKalman = FormedKalman<S, SquareRoot<typename S::Scalar, S::kErrors>>;

}  // namespace tetap::filter
