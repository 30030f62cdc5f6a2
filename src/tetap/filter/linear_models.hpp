// SPDX-License-Identifier: Apache-2.0
// Linear models as matrices, which may be others at every step: x+ = F x + B u + w, z = H x + v.
#pragma once

#include "tetap/filter/sigma_points.hpp"
#include "tetap/filter/state.hpp"
#include "tetap/filter/triangular.hpp"

namespace tetap::filter {

/// w ~ N(0, Q), u known.
template <class Scalar, int N, int U>
struct ControlledMotion {
  Matrix<Scalar, N, N> f = Matrix<Scalar, N, N>::Identity();
  Matrix<Scalar, N, U> b = Matrix<Scalar, N, U>::Zero();
  Vector<Scalar, U> u = Vector<Scalar, U>::Zero();
  Symmetric<Scalar, N> q;

  [[nodiscard]] VectorState<Scalar, N> predict(const VectorState<Scalar, N>& x) const {
    return {f.lazyProduct(x.value) + b.lazyProduct(u)};
  }
  [[nodiscard]] Matrix<Scalar, N, N> jacobian(const VectorState<Scalar, N>&) const { return f; }
  [[nodiscard]] Symmetric<Scalar, N> noise(const VectorState<Scalar, N>&) const { return q; }
};

/// v ~ N(0, diag(variance)).
template <class Scalar, int N, int M>
struct LinearMeasurement {
  static constexpr int kDimension = M;
  static constexpr auto kTouches = all_indices<N>();

  Matrix<Scalar, M, N> h = Matrix<Scalar, M, N>::Zero();
  Vector<Scalar, M> z = Vector<Scalar, M>::Zero();
  Vector<Scalar, M> variance = Vector<Scalar, M>::Zero();

  [[nodiscard]] Vector<Scalar, M> predict(const VectorState<Scalar, N>& x) const { return h.lazyProduct(x.value); }
  [[nodiscard]] Vector<Scalar, M> residual(const Vector<Scalar, M>& z_hat) const { return z - z_hat; }
  [[nodiscard]] Vector<Scalar, M> noise() const { return variance; }
  [[nodiscard]] Matrix<Scalar, M, N> jacobian(const VectorState<Scalar, N>&) const { return h; }
};

/// The same measurement with independent components of variance 1, for a full R = C^T C: C^-T z = C^-T H x + v'
/// (Bierman 1977, ch. III). R has to be positive definite.
template <class Scalar, int N, int M>
[[nodiscard]] LinearMeasurement<Scalar, N, M> independent_components(const Matrix<Scalar, M, N>& h,
                                                                     const Vector<Scalar, M>& z,
                                                                     const Symmetric<Scalar, M>& r) {
  const Triangular<Scalar, M> c = root_of(r);
  LinearMeasurement<Scalar, N, M> out{.h = h, .z = z, .variance = Vector<Scalar, M>::Ones()};
  for (int m = 0; m < M; ++m) {
    for (int k = 0; k < m; ++k) {
      out.h.row(m) -= c(k, m) * out.h.row(k);
      out.z(m) -= c(k, m) * out.z(k);
    }
    const Scalar inverse = Scalar{1} / c(m, m);
    out.h.row(m) *= inverse;
    out.z(m) *= inverse;
  }
  return out;
}

}  // namespace tetap::filter
