// SPDX-License-Identifier: Apache-2.0
// The measurement update every Kalman-type filter here shares: one joint Mahalanobis gate, then the scalar updates in
// sequence.
//
// With S = H P H^T + R = L L^T (Cholesky), y = L^-1 nu and G = P H^T L^-T:
//   NIS = y^T y,   dx = G y,   P+ = P - G G^T.
// Column j of G is the gain of the j-th scalar update after those before it. Bierman 1977, ch. V, has the sequence,
// here written as a factorisation. The gate is known before anything is changed, and P+ needs one pass over its upper
// half.
#pragma once

#include "tetap/base/math.hpp"
#include "tetap/filter/symmetric.hpp"

#include <array>
#include <cstddef>
#include <cstdint>

namespace tetap::filter {

enum class Verdict : std::uint8_t { kAccepted, kRejected, kSingular, kNotFinite };

/// Innovation of a measurement and its verdict.
template <class Scalar, int M>
struct Innovation {
  Vector<Scalar, M> nu = Vector<Scalar, M>::Zero();  ///< measured minus predicted, units of the measurement
  Symmetric<Scalar, M> s;                            ///< covariance H P H^T + R of the innovation
  Scalar nis = 0;   ///< nu^T S^-1 nu: chi-square with M degrees of freedom when all is well
  Scalar gate = 0;  ///< the NIS above which it is rejected
  Verdict verdict = Verdict::kNotFinite;
};

template <class Scalar, int N, int M>
struct Update {
  Innovation<Scalar, M> innovation;
  Vector<Scalar, N> dx = Vector<Scalar, N>::Zero();  ///< error-state correction; zero unless accepted
};

/// Implements docs/explanation/equations.md (2) to (4).
/// H is given over the K error states named in `touches` only: column k of `h` belongs to state touches[k].
/// P is changed only when the verdict is kAccepted. `noise` are the variances of independent components.
template <class Scalar, int N, int M, std::size_t K>
[[nodiscard]] Update<Scalar, N, M> update(Symmetric<Scalar, N>& p, const Matrix<Scalar, M, static_cast<int>(K)>& h,
                                          const std::array<int, K>& touches, const Vector<Scalar, M>& nu,
                                          const Vector<Scalar, M>& noise, Scalar gate) {
  Update<Scalar, N, M> result;
  Innovation<Scalar, M>& record = result.innovation;
  record.nu = nu;
  record.gate = gate;

  Matrix<Scalar, N, M> g;  // begins as P H^T, becomes G column by column
#pragma GCC unroll 16
  for (int m = 0; m < M; ++m)
#pragma GCC unroll 16
    for (int n = 0; n < N; ++n) {
      Scalar sum = 0;
#pragma GCC unroll 16
      for (std::size_t k = 0; k < K; ++k) sum += p(n, touches[k]) * h(m, static_cast<int>(k));
      g(n, m) = sum;
    }
#pragma GCC unroll 16
  for (int c = 0; c < M; ++c)
#pragma GCC unroll 16
    for (int r = 0; r <= c; ++r) {
      Scalar sum = r == c ? noise(c) : Scalar{0};
#pragma GCC unroll 16
      for (std::size_t k = 0; k < K; ++k) sum += h(r, static_cast<int>(k)) * g(touches[k], c);
      record.s(r, c) = sum;
    }

  Symmetric<Scalar, M> l;  // l(i, j), i <= j, is L_ji
  Vector<Scalar, M> y;
#pragma GCC unroll 16
  for (int j = 0; j < M; ++j) {
#pragma GCC unroll 16
    for (int i = 0; i < j; ++i) {
      Scalar sum = record.s(i, j);
#pragma GCC unroll 16
      for (int k = 0; k < i; ++k) sum -= l(k, i) * l(k, j);
      l(i, j) = sum / l(i, i);
    }
    Scalar pivot = record.s(j, j);
#pragma GCC unroll 16
    for (int k = 0; k < j; ++k) pivot -= l(k, j) * l(k, j);
    if (!(pivot > Scalar{0}) || !(pivot < Scalar(1e30F))) {
      record.verdict = pivot <= Scalar{0} ? Verdict::kSingular : Verdict::kNotFinite;
      return result;
    }
    l(j, j) = base::sqrt(pivot);
    Scalar sum = nu(j);
#pragma GCC unroll 16
    for (int k = 0; k < j; ++k) sum -= l(k, j) * y(k);
    y(j) = sum / l(j, j);
  }
  record.nis = y.dot(y);
  if (!(record.nis < Scalar(1e30F))) return result;  // NaN or beyond every gate: kNotFinite
  if (!(record.nis <= gate)) {
    record.verdict = Verdict::kRejected;
    return result;
  }
  record.verdict = Verdict::kAccepted;

#pragma GCC unroll 16
  for (int j = 0; j < M; ++j) {
    const Scalar inverse = Scalar{1} / l(j, j);
#pragma GCC unroll 16
    for (int n = 0; n < N; ++n) {
      Scalar sum = g(n, j);
#pragma GCC unroll 16
      for (int k = 0; k < j; ++k) sum -= g(n, k) * l(k, j);
      g(n, j) = sum * inverse;
    }
  }
#pragma GCC unroll 16
  for (int n = 0; n < N; ++n) result.dx(n) = g.row(n).dot(y.transpose());
#pragma GCC unroll 16
  for (int c = 0; c < N; ++c) {
    // In float the difference can lose every digit when the measurement is 10^7 times better than the prediction. A
    // variance never falls below the rounding error of what it was. P stays positive where the exact result would be.
    const Scalar floor = p(c, c) * Scalar(2.4e-7F);
#pragma GCC unroll 16
    for (int r = 0; r <= c; ++r) p(r, c) -= g.row(r).dot(g.row(c));
    if (!(p(c, c) > floor)) p(c, c) = floor;
  }
  return result;
}

/// Chi-square quantiles at 99 % for 1 to 6 degrees of freedom (Abramowitz & Stegun, table 26.8): the usual gate.
[[nodiscard]] constexpr float chi_square_99(int degrees) {
  constexpr std::array<float, 6> kQuantile{6.635F, 9.210F, 11.345F, 13.277F, 15.086F, 16.812F};
  return kQuantile[static_cast<std::size_t>(degrees < 1 ? 0 : degrees > 6 ? 5 : degrees - 1)];
}

}  // namespace tetap::filter
