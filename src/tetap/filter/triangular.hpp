// SPDX-License-Identifier: Apache-2.0
// Square root of a covariance: an upper triangular R with P = R^T R, kept by plane rotations. P is positive whatever is
// rounded (Golub & Van Loan 2013, sec. 5.1.8 and 6.5; Bierman 1977, ch. V and VI; Kailath, Sayed, Hassibi 2000,
// ch. 12).
#pragma once

#include "tetap/filter/symmetric.hpp"
#include "tetap/filter/unroll.hpp"

#include <array>
#include <cstddef>

namespace tetap::filter {

/// Cosine and sine that turn (a, b) into (length, 0), length >= 0.
template <class Scalar>
struct Rotation {
  Scalar cosine = 1, sine = 0, length = 0;

  [[gnu::always_inline]] Rotation(Scalar a, Scalar b) : length(base::sqrt(a * a + b * b)) {
    if (!(length > Scalar{0})) return;
    const Scalar inverse = Scalar{1} / length;
    cosine = a * inverse;
    sine = b * inverse;
  }
  /// (a, b) turned by the same angle.
  [[gnu::always_inline]] void turn(Scalar& a, Scalar& b) const {
    const Scalar along = cosine * a + sine * b;
    b = cosine * b - sine * a;
    a = along;
  }
};

template <class Scalar_, int N>
class Triangular {
 public:
  using Scalar = Scalar_;

  constexpr Triangular() = default;

  /// R(r, c) for r <= c; below the diagonal there is nothing.
  [[nodiscard]] constexpr Scalar operator()(int r, int c) const { return packed_[index(r, c)]; }
  [[nodiscard]] constexpr Scalar& operator()(int r, int c) { return packed_[index(r, c)]; }
  [[nodiscard]] constexpr const auto& packed() const { return packed_; }

  /// R^T R becomes R^T R + row row^T. Entries of `row` before kFrom are zero.
  template <int kFrom = 0>
  [[gnu::always_inline]] void absorb(Vector<Scalar, N> row) {
    unroll<kFrom, N>([&](auto i) __attribute__((always_inline)) {
      const Rotation<Scalar> by((*this)(i, i), row(int{i}));
      (*this)(i, i) = by.length;
      unroll<i + 1, N>([&](auto c) __attribute__((always_inline)) { by.turn((*this)(i, c), row(int{c})); });
    });
  }

  /// R^T R.
  [[nodiscard]] Symmetric<Scalar, N> covariance() const {
    Symmetric<Scalar, N> p;
#pragma GCC unroll 16
    for (int c = 0; c < N; ++c)
#pragma GCC unroll 16
      for (int r = 0; r <= c; ++r) {
        Scalar sum = 0;
#pragma GCC unroll 16
        for (int k = 0; k <= r; ++k) sum += (*this)(k, r) * (*this)(k, c);
        p(r, c) = sum;
      }
    return p;
  }

  /// Every entry is a number and every diagonal one is above zero, so R^T R is positive definite.
  [[nodiscard]] bool regular() const {
    Scalar nothing = 0;
#pragma GCC unroll 16
    for (const Scalar v : packed_) nothing += v * Scalar{0};
    bool positive = nothing >= Scalar{0};
#pragma GCC unroll 16
    for (int i = 0; i < N; ++i) positive = positive && (*this)(i, i) > Scalar{0} && (*this)(i, i) < Scalar(1e15F);
    return positive;
  }

 private:
  static constexpr std::size_t index(int r, int c) {
    const auto column = static_cast<std::size_t>(c);
    return column * (column + 1) / 2 + static_cast<std::size_t>(r);
  }
  std::array<Scalar, static_cast<std::size_t>(N) * (N + 1) / 2> packed_{};
};

/// R with R^T R = P. A pivot that is not above zero gives a row of zeros, so noise may miss some directions.
template <class Scalar, int N>
[[nodiscard]] Triangular<Scalar, N> root_of(const Symmetric<Scalar, N>& p) {
  Triangular<Scalar, N> r;
#pragma GCC unroll 16
  for (int i = 0; i < N; ++i) {
    Scalar pivot = p(i, i);
#pragma GCC unroll 16
    for (int k = 0; k < i; ++k) pivot -= r(k, i) * r(k, i);
    if (!(pivot > Scalar{0})) continue;
    r(i, i) = base::sqrt(pivot);
    const Scalar inverse = Scalar{1} / r(i, i);
#pragma GCC unroll 16
    for (int c = i + 1; c < N; ++c) {
      Scalar sum = p(i, c);
#pragma GCC unroll 16
      for (int k = 0; k < i; ++k) sum -= r(k, i) * r(k, c);
      r(i, c) = sum * inverse;
    }
  }
  return r;
}

/// Correction in square-root form. Rows (slope(j) | R(j)) join the root of the innovation's remaining covariance:
///   [ E  0 ]                 [ S^1/2  W   ]
///   [ C  R ]  by rotations = [ 0      R+  ],   K nu = W^T S^-T/2 nu,   NIS = |S^-T/2 nu|^2.
/// `e` is the root of that part of S that comes from noise. `slope` is C: row j is the measurement along row j of R.
template <class Scalar, int N, int M>
struct RootCorrection {
  Triangular<Scalar, M> s;     ///< S = s^T s
  Matrix<Scalar, M, N> gain;   ///< W
  Triangular<Scalar, N> root;  ///< factor of P+

  [[gnu::always_inline]] RootCorrection(const Triangular<Scalar, N>& prior, const Triangular<Scalar, M>& e,
                                        const Matrix<Scalar, N, M>& slope)
      : s(e), gain(Matrix<Scalar, M, N>::Zero()), root(prior) {
    // From the last row up: row j of R fills W from column j on, and stays triangular.
    unroll<0, N>([&](auto back) __attribute__((always_inline)) {
      constexpr int j = N - 1 - back;
      Vector<Scalar, M> row = slope.row(j).transpose();
      unroll<0, M>([&](auto m) __attribute__((always_inline)) {
        const Rotation<Scalar> by(s(m, m), row(int{m}));
        s(m, m) = by.length;
        unroll<m + 1, M>([&](auto c) __attribute__((always_inline)) { by.turn(s(m, c), row(int{c})); });
        unroll<j, N>([&](auto n) __attribute__((always_inline)) { by.turn(gain(int{m}, int{n}), root(j, n)); });
      });
    });
  }

  /// y with s^T y = nu.
  [[nodiscard, gnu::always_inline]] Vector<Scalar, M> whitened(const Vector<Scalar, M>& nu) const {
    Vector<Scalar, M> y = nu;
    unroll<0, M>([&](auto m) __attribute__((always_inline)) {
      unroll<0, m>([&](auto k) __attribute__((always_inline)) { y(int{m}) -= s(k, m) * y(int{k}); });
      y(int{m}) = y(int{m}) / s(m, m);
    });
    return y;
  }
};

}  // namespace tetap::filter
