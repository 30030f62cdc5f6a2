// SPDX-License-Identifier: Apache-2.0
// Zeros and ones of a model, declared by its types, so that no instruction multiplies by them. F may be the unit matrix
// and a few entries, Q a few entries. H may pick states or have constants.
#pragma once

#include "tetap/base/multiply_add.hpp"
#include "tetap/filter/symmetric.hpp"
#include "tetap/filter/unroll.hpp"

#include <array>
#include <cstddef>
#include <cstdint>

namespace tetap::filter {

struct Entry {
  int row, column;
};

/// I + sum value[k] e_row(k) e_column(k)^T: what jacobian() of a motion model may return instead of a dense matrix.
template <class Scalar, int N, Entry... kEntries>
struct UnitPlus {
  static constexpr std::array<Entry, sizeof...(kEntries)> kAt{kEntries...};
  std::array<Scalar, sizeof...(kEntries)> value;

  [[nodiscard]] Matrix<Scalar, N, N> dense() const {
    Matrix<Scalar, N, N> full = Matrix<Scalar, N, N>::Identity();
    for (std::size_t k = 0; k < kAt.size(); ++k) full(kAt[k].row, kAt[k].column) += value[k];
    return full;
  }
};

/// A symmetric matrix with these entries of its upper half only: what noise() may return.
template <class Scalar, int N, Entry... kEntries>
struct SparseSymmetric {
  static constexpr std::array<Entry, sizeof...(kEntries)> kAt{kEntries...};
  static_assert(((kEntries.row <= kEntries.column) && ...), "entries of the upper half");
  std::array<Scalar, sizeof...(kEntries)> value;

  [[nodiscard]] Symmetric<Scalar, N> dense() const {
    Symmetric<Scalar, N> full;
    for (std::size_t k = 0; k < kAt.size(); ++k) full(kAt[k].row, kAt[k].column) += value[k];
    return full;
  }
};

/// A coefficient of H that is known beforehand. A measurement model may have kShape, one for each entry, row by row. It
/// may have kSelects instead: row m of H is then a one in column kTouches[m].
enum class Coefficient : std::uint8_t { kZero, kOne, kMinusOne, kValue };

namespace detail {

/// (F P)(R, C), from entry K of F on.
template <class F, int R, int C, std::size_t K, class P>
[[nodiscard, gnu::always_inline]] inline auto left_product(const P& p, const F& f) {
  if constexpr (K == F::kAt.size()) {
    return p(R, C);
  } else if constexpr (F::kAt[K].row == R) {
    return base::add_product(left_product<F, R, C, K + 1>(p, f), f.value[K], p(F::kAt[K].column, C));
  } else {
    return left_product<F, R, C, K + 1>(p, f);
  }
}
/// (F P F^T)(R, C), from entry K of the right F on.
template <class F, int R, int C, std::size_t K, class P>
[[nodiscard, gnu::always_inline]] inline auto both_products(const P& p, const F& f) {
  if constexpr (K == F::kAt.size()) {
    return left_product<F, R, C, 0>(p, f);
  } else if constexpr (F::kAt[K].row == C) {
    return base::add_product(both_products<F, R, C, K + 1>(p, f), f.value[K],
                             left_product<F, R, F::kAt[K].column, 0>(p, f));
  } else {
    return both_products<F, R, C, K + 1>(p, f);
  }
}

}  // namespace detail

/// F P F^T by the entries of F.
template <class Scalar, int N, Entry... kEntries>
[[nodiscard, gnu::always_inline]] inline Symmetric<Scalar, N> turned(const Symmetric<Scalar, N>& p,
                                                                     const UnitPlus<Scalar, N, kEntries...>& f) {
  Symmetric<Scalar, N> next;
  unroll<0, N>([&](auto c) __attribute__((always_inline)) {
    unroll<0, c + 1>([&](auto r) __attribute__((always_inline)) {
      next(r, c) = detail::both_products<UnitPlus<Scalar, N, kEntries...>, r, c, 0>(p, f);
    });
  });
  return next;
}
template <class Scalar, int N>
[[nodiscard]] Symmetric<Scalar, N> turned(const Symmetric<Scalar, N>& p, const Matrix<Scalar, N, N>& f) {
  return propagate(p, f, Symmetric<Scalar, N>{});
}

template <class Scalar, int N, Entry... kEntries>
[[gnu::always_inline]] inline void add_noise(Symmetric<Scalar, N>& p,
                                             const SparseSymmetric<Scalar, N, kEntries...>& q) {
  unroll<0, static_cast<int>(sizeof...(kEntries))>([&](auto k) __attribute__((always_inline)) {
    constexpr Entry kAt = SparseSymmetric<Scalar, N, kEntries...>::kAt[static_cast<std::size_t>(int{k})];
    p(kAt.row, kAt.column) += q.value[static_cast<std::size_t>(int{k})];
  });
}
template <class Scalar, int N>
[[nodiscard]] const Symmetric<Scalar, N>& dense(const Symmetric<Scalar, N>& q) {
  return q;
}
template <class Scalar, int N, Entry... kEntries>
[[nodiscard]] Symmetric<Scalar, N> dense(const SparseSymmetric<Scalar, N, kEntries...>& q) {
  return q.dense();
}
template <class Scalar, int N>
[[gnu::always_inline]] inline void add_noise(Symmetric<Scalar, N>& p, const Symmetric<Scalar, N>& q) {
  unroll<0, N>([&](auto c) __attribute__((always_inline)) {
    unroll<0, c + 1>([&](auto r) __attribute__((always_inline)) { p(r, c) += q(r, c); });
  });
}

}  // namespace tetap::filter
