// SPDX-License-Identifier: Apache-2.0
// The Kalman correction from the cross covariance of state and measurement: one joint gate, no square root, and one
// division per component.
//
// With S = U^T D U (U unit upper triangular) and G = T U^-1, for T = cov(x, z), y = U^-T nu:
//   NIS = y^T D^-1 y,   dx = G D^-1 y,   P+ = P - G D^-1 G^T.
// Golub & Van Loan 2013, sec. 4.1.2 (the factor); Bierman 1977, ch. V (one component after another).
#pragma once

#include "tetap/base/multiply_add.hpp"
#include "tetap/filter/unroll.hpp"
#include "tetap/filter/update.hpp"

namespace tetap::filter {

/// Gate of a filter that computes no NIS and accepts every measurement.
struct NoGate {};

/// T = cov(x, z) made independent component by component, and what the innovation became under the same steps.
template <class Scalar, int N, int M>
struct Decorrelated {
  Matrix<Scalar, N, M> g;
  Vector<Scalar, M> y;
  Vector<Scalar, M> inverse;  ///< 1 / d(j)
  bool positive = true;       ///< every d(j) is above zero and below 1e30
};

/// Takes T = cov(x, z), S and nu apart. S needs no positivity beforehand. kFloor: what a component shows beyond those
/// before it is no less than the rounding of its variance; equal sensors far sharper than the prediction stay two.
template <bool kFloor = false, class Scalar, int N, int M>
[[nodiscard, gnu::always_inline]] inline Decorrelated<Scalar, N, M> decorrelate(const Matrix<Scalar, N, M>& cross,
                                                                                const Symmetric<Scalar, M>& s,
                                                                                const Vector<Scalar, M>& nu) {
  Decorrelated<Scalar, N, M> out;
  Symmetric<Scalar, M> u;  // d(k) u(k, j) above the diagonal
  out.g = cross;
  unroll<0, M>([&](auto j) __attribute__((always_inline)) {
    Scalar d = s(j, j);
    Scalar y = nu(int{j});
    unroll<0, j>([&](auto k) __attribute__((always_inline)) {
      Scalar sum = s(k, j);
      unroll<0, k>([&](auto i) __attribute__((always_inline)) { sum -= u(i, k) * out.inverse(int{i}) * u(i, j); });
      const Scalar l = sum * out.inverse(int{k});
      d = base::subtract_product(d, l, sum);
      y = base::subtract_product(y, l, Scalar{out.y(int{k})});
      unroll<0, N>([&](auto n) __attribute__((always_inline)) {
        out.g(int{n}, int{j}) = base::subtract_product(Scalar{out.g(int{n}, int{j})}, l, Scalar{out.g(int{n}, int{k})});
      });
      u(k, j) = sum;
    });
    if constexpr (kFloor && j > 0) {
      const Scalar floor = s(j, j) * Scalar(2.4e-7F);
      if (d < floor) d = floor;
    }
    out.positive = out.positive && d > Scalar{0} && d < Scalar(1e30F);
    out.inverse(int{j}) = Scalar{1} / d;
    out.y(int{j}) = y;
  });
  return out;
}

/// P -= G D^-1 G^T. With the floor, a variance keeps the rounding error of what it was, so that P stays positive in
/// float.
template <bool kFloor = true, class Scalar, int N, int M>
[[gnu::always_inline]] inline void subtract_gain(Symmetric<Scalar, N>& p, const Decorrelated<Scalar, N, M>& by) {
  unroll<0, N>([&](auto c) __attribute__((always_inline)) {
    Vector<Scalar, M> k;
    unroll<0, M>([&](auto j) __attribute__((always_inline)) { k(int{j}) = by.g(int{c}, int{j}) * by.inverse(int{j}); });
    const Scalar floor = p(c, c) * Scalar(2.4e-7F);
    unroll<0, c + 1>([&](auto r) __attribute__((always_inline)) {
      Scalar rest = p(r, c);
      unroll<0, M>([&](auto j) __attribute__((always_inline)) {
        rest = base::subtract_product(rest, Scalar{by.g(int{r}, int{j})}, Scalar{k(int{j})});
      });
      if (kFloor && r == c && !(rest > floor)) rest = floor;
      p(r, c) = rest;
    });
  });
}

/// dx = G D^-1 y.
template <class Scalar, int N, int M>
[[nodiscard, gnu::always_inline]] inline Vector<Scalar, N> state_correction(const Decorrelated<Scalar, N, M>& by) {
  Vector<Scalar, N> dx;
  unroll<0, N>([&](auto n) __attribute__((always_inline)) {
    Scalar sum = by.g(int{n}, 0) * (by.y(0) * by.inverse(0));
    unroll<1, M>([&](auto j) __attribute__((always_inline)) {
      sum = base::add_product(sum, Scalar{by.g(int{n}, int{j})}, Scalar{by.y(int{j}) * by.inverse(int{j})});
    });
    dx(int{n}) = sum;
  });
  return dx;
}

/// The whole correction. P changes only when the verdict is kAccepted.
template <class Scalar, int N, int M>
[[nodiscard, gnu::always_inline]] inline Update<Scalar, N, M> correct(Symmetric<Scalar, N>& p,
                                                                      const Matrix<Scalar, N, M>& cross,
                                                                      const Symmetric<Scalar, M>& s,
                                                                      const Vector<Scalar, M>& nu, Scalar gate) {
  Update<Scalar, N, M> result;
  Innovation<Scalar, M>& record = result.innovation;
  record.nu = nu;
  record.s = s;
  record.gate = gate;
  const Decorrelated<Scalar, N, M> by = decorrelate(cross, s, nu);
  if (!by.positive) {
    record.verdict = s.bounded() ? Verdict::kSingular : Verdict::kNotFinite;
    return result;
  }
  unroll<0, M>([&](auto j)
                   __attribute__((always_inline)) { record.nis += by.y(int{j}) * by.y(int{j}) * by.inverse(int{j}); });
  if (!(record.nis < Scalar(1e30F))) return result;  // NaN or beyond every gate: kNotFinite
  if (!(record.nis <= gate)) {
    record.verdict = Verdict::kRejected;
    return result;
  }
  record.verdict = Verdict::kAccepted;
  result.dx = state_correction(by);
  subtract_gain(p, by);
  return result;
}

}  // namespace tetap::filter
