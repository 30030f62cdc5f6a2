// SPDX-License-Identifier: Apache-2.0
// The covariance as one symmetric matrix, not as factors: the part that the Joseph and the sequential form share.
#pragma once

#include "tetap/filter/symmetric.hpp"

namespace tetap::filter {

template <class Scalar, int N>
class WholeCovariance {
 public:
  explicit WholeCovariance(const Symmetric<Scalar, N>& p) : p_(p) {}
  [[nodiscard]] Symmetric<Scalar, N> covariance() const { return p_; }

  /// Implements docs/explanation/kalman_forms.md (1).
  /// P = F P F^T + Q. False, and nothing has changed, when a component of the result is no number.
  bool propagate(const Matrix<Scalar, N, N>& f, const Symmetric<Scalar, N>& q) {
    const Symmetric<Scalar, N> next = filter::propagate(p_, f, q);
    if (!next.bounded()) return false;
    p_ = next;
    return true;
  }

 protected:
  Symmetric<Scalar, N> p_;
};

}  // namespace tetap::filter
