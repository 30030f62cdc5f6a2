// SPDX-License-Identifier: Apache-2.0
// A covariance that is symmetric because only its upper half exists.
#pragma once

#include "tetap/base/math.hpp"
#include "tetap/base/math_double.hpp"

#include <Eigen/Core>
#include <array>

namespace tetap::filter {

template <class Scalar, int N>
using Vector = Eigen::Matrix<Scalar, N, 1>;

template <class Scalar, int Rows, int Columns>
using Matrix = Eigen::Matrix<Scalar, Rows, Columns>;

template <class Scalar_, int N>
class Symmetric {
 public:
  using Scalar = Scalar_;
  static constexpr int kSize = N;

  constexpr Symmetric() = default;
  static constexpr Symmetric diagonal(const std::array<Scalar, N>& variances) {
    Symmetric result;
#pragma GCC unroll 16
    for (int i = 0; i < N; ++i) result(i, i) = variances[static_cast<std::size_t>(i)];
    return result;
  }
  /// The upper half of a square matrix; what is below the diagonal is not looked at.
  static Symmetric upper_of(const Matrix<Scalar, N, N>& full) {
    Symmetric result;
#pragma GCC unroll 16
    for (int c = 0; c < N; ++c)
#pragma GCC unroll 16
      for (int r = 0; r <= c; ++r) result(r, c) = full(r, c);
    return result;
  }

  /// Adds independent variances.
  constexpr void add_diagonal(const std::array<Scalar, N>& variances) {
    for (int i = 0; i < N; ++i) (*this)(i, i) += variances[static_cast<std::size_t>(i)];
  }
  [[nodiscard]] constexpr Scalar operator()(int r, int c) const { return packed_[index(r, c)]; }
  [[nodiscard]] constexpr Scalar& operator()(int r, int c) { return packed_[index(r, c)]; }
  [[nodiscard]] constexpr const auto& packed() const { return packed_; }

  /// Assignment for large ones: words are copied in groups, with neither a call nor a loop over single words.
  [[gnu::always_inline]] void copy_from(const Symmetric& other) {
    constexpr std::size_t kGroup = 10, kWords = static_cast<std::size_t>(N) * (N + 1) / 2;
    const Scalar* from = other.packed_.data();
    Scalar* to = packed_.data();
    const Scalar* const end = from + kWords / kGroup * kGroup;
    while (from != end) {
      std::array<Scalar, kGroup> group;
#pragma GCC unroll 16
      for (std::size_t i = 0; i < kGroup; ++i) group[i] = from[i];
#pragma GCC unroll 16
      for (std::size_t i = 0; i < kGroup; ++i) to[i] = group[i];
      from += kGroup;
      to += kGroup;
    }
    for (std::size_t i = 0; i < kWords % kGroup; ++i) to[i] = from[i];
  }

  [[nodiscard]] Matrix<Scalar, N, N> dense() const {
    Matrix<Scalar, N, N> full;
#pragma GCC unroll 16
    for (int c = 0; c < N; ++c)
#pragma GCC unroll 16
      for (int r = 0; r < N; ++r) full(r, c) = (*this)(r, c);
    return full;
  }

  /// No entry is NaN or infinite, and no variance is above 2e30. The test holds for a covariance: the sum over its
  /// upper half is at least half of its trace.
  [[nodiscard]] constexpr bool bounded() const {
    Scalar sum = 0;
#pragma GCC unroll 16
    for (const Scalar v : packed_) sum += v;
    return sum < Scalar(1e30F) && sum > Scalar(-1e30F);
  }

  [[nodiscard]] constexpr bool no_variance_below_zero() const {
    bool none = true;
#pragma GCC unroll 16
    for (int i = 0; i < N; ++i) none = none && (*this)(i, i) >= Scalar{0};
    return none;
  }

  /// True when an L L^T factor with pivots above zero exists (and so no entry is NaN).
  [[nodiscard]] bool positive_definite() const {
    Symmetric l = *this;
#pragma GCC unroll 16
    for (int j = 0; j < N; ++j) {
#pragma GCC unroll 16
      for (int i = 0; i < j; ++i) {
        Scalar sum = l(i, j);
#pragma GCC unroll 16
        for (int k = 0; k < i; ++k) sum -= l(k, i) * l(k, j);
        l(i, j) = sum / l(i, i);
      }
      Scalar pivot = l(j, j);
#pragma GCC unroll 16
      for (int k = 0; k < j; ++k) pivot -= l(k, j) * l(k, j);
      if (!(pivot > Scalar{0}) || !(pivot < Scalar(1e30F))) return false;
      l(j, j) = base::sqrt(pivot);
    }
    return true;
  }

 private:
  static constexpr std::size_t index(int r, int c) {
    const auto low = static_cast<std::size_t>(r < c ? r : c);
    const auto high = static_cast<std::size_t>(r < c ? c : r);
    return high * (high + 1) / 2 + low;
  }
  std::array<Scalar, static_cast<std::size_t>(N) * (N + 1) / 2> packed_{};
};

/// F P F^T + Q, upper half only.
template <class Scalar, int N>
[[nodiscard]] Symmetric<Scalar, N> propagate(const Symmetric<Scalar, N>& p, const Matrix<Scalar, N, N>& f,
                                             const Symmetric<Scalar, N>& q) {
  const Matrix<Scalar, N, N> fp = f.lazyProduct(p.dense());
  Symmetric<Scalar, N> result = q;
#pragma GCC unroll 16
  for (int c = 0; c < N; ++c)
#pragma GCC unroll 16
    for (int r = 0; r <= c; ++r) result(r, c) += fp.row(r).dot(f.row(c));
  return result;
}

}  // namespace tetap::filter
