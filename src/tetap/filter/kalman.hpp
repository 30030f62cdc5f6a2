// SPDX-License-Identifier: Apache-2.0
// Linear Kalman filter (Kalman 1960) with all guards: matrices for models, or models that declare their structure.
#pragma once

#include "tetap/filter/ekf.hpp"
#include "tetap/filter/structured_kalman.hpp"

#include <array>

namespace tetap::filter {

/// x+ = F x + w, w ~ N(0, Q).
template <class Scalar, int N>
struct LinearMotion {
  Matrix<Scalar, N, N> f = Matrix<Scalar, N, N>::Identity();
  Symmetric<Scalar, N> q;

  [[nodiscard]] VectorState<Scalar, N> predict(const VectorState<Scalar, N>& x) const {
    return {f.lazyProduct(x.value)};
  }
  [[nodiscard]] Matrix<Scalar, N, N> jacobian(const VectorState<Scalar, N>&) const { return f; }
  [[nodiscard]] Symmetric<Scalar, N> noise(const VectorState<Scalar, N>&) const { return q; }
};

/// Some of the states measured directly: z = x[states] + v, v ~ N(0, diag(variance)).
template <class Scalar, int N, int... States>
struct DirectMeasurement {
  static constexpr int kDimension = sizeof...(States);
  static constexpr std::array<int, sizeof...(States)> kTouches{States...};
  static constexpr bool kSelects = true;  ///< H picks states: see structure.hpp
  static_assert(((States >= 0 && States < N) && ...));

  Vector<Scalar, kDimension> z;
  Vector<Scalar, kDimension> variance;

  [[nodiscard]] Vector<Scalar, kDimension> predict(const VectorState<Scalar, N>& x) const {
    Vector<Scalar, kDimension> z_hat;
    for (int i = 0; i < kDimension; ++i) z_hat(i) = x.value(kTouches[static_cast<std::size_t>(i)]);
    return z_hat;
  }
  [[nodiscard]] Vector<Scalar, kDimension> residual(const Vector<Scalar, kDimension>& z_hat) const { return z - z_hat; }
  [[nodiscard]] Vector<Scalar, kDimension> noise() const { return variance; }
  [[nodiscard]] Matrix<Scalar, kDimension, kDimension> jacobian(const VectorState<Scalar, N>&) const {
    return Matrix<Scalar, kDimension, kDimension>::Identity();
  }
};

template <class Scalar, int N>
using Kalman = StructuredKalman<VectorState<Scalar, N>, Guard::kConditioned>;

}  // namespace tetap::filter
