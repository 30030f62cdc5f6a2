// SPDX-License-Identifier: Apache-2.0
// A covariance of many states of which some are in use: states are added and removed at run time, updates are of low
// rank. Only the upper half exists, packed by columns, so that a new state is a new column at the end.
#pragma once

#include <array>
#include <cstddef>

namespace tetap::filter {

template <class Scalar_, int kMost>
class BigCovariance {
 public:
  using Scalar = Scalar_;
  /// A number for each state in use.
  using States = std::array<Scalar, static_cast<std::size_t>(kMost)>;

  [[nodiscard]] int size() const { return size_; }
  [[nodiscard]] bool full() const { return size_ == kMost; }
  [[nodiscard]] Scalar operator()(int r, int c) const { return packed_[index(r, c)]; }
  [[nodiscard]] Scalar& operator()(int r, int c) { return packed_[index(r, c)]; }
  void clear() { size_ = 0; }

  /// One more state, by its covariance with each state before it and its own variance. False, and nothing has changed,
  /// when all kMost are in use.
  [[nodiscard]] bool add(const States& covariance, Scalar variance) {
    if (full()) return false;
    for (int r = 0; r < size_; ++r) packed_[index(r, size_)] = covariance[at(r)];
    packed_[index(size_, size_)] = variance;
    ++size_;
    return true;
  }

  /// Takes `count` states from `first` out, which is marginalisation, and exact: the last `count` states take their
  /// places. Nothing else changes by a bit.
  void remove(int first, int count) {
    for (int k = count - 1; k >= 0; --k) {
      const int gone = first + k, last = size_ - 1;
      for (int i = 0; i < last; ++i)
        if (i != gone) packed_[index(i, gone)] = packed_[index(i, last)];
      if (gone != last) packed_[index(gone, gone)] = packed_[index(last, last)];
      --size_;
    }
  }

  /// P h for a row h that is zero but at K states.
  template <std::size_t K>
  void times(const std::array<Scalar, K>& h, const std::array<int, K>& touches, States& product) const {
    for (int n = 0; n < size_; ++n) {
      Scalar sum = 0;
      for (std::size_t k = 0; k < K; ++k) sum += packed_[index(n, touches[k])] * h[k];
      product[at(n)] = sum;
    }
  }

  /// P -= sum of g g^T, in one pass over P.
  template <std::size_t kRank>
  void subtract(const std::array<States, kRank>& g) {
    for (int c = 0; c < size_; ++c)
      for (int r = 0; r <= c; ++r) {
        Scalar sum = packed_[index(r, c)];
        for (std::size_t k = 0; k < kRank; ++k) sum -= g[k][at(r)] * g[k][at(c)];
        packed_[index(r, c)] = sum;
      }
  }

  /// P = T P T^T for T = I + u e_k^T, u zero at k: each state's error has u times that of state k added.
  void shear(int k, const States& u) {
    States p;
    for (int n = 0; n < size_; ++n) p[at(n)] = packed_[index(n, k)];
    const Scalar half = p[at(k)] / 2;
    for (int n = 0; n < size_; ++n) p[at(n)] += half * u[at(n)];
    for (int c = 0; c < size_; ++c)
      for (int r = 0; r <= c; ++r) packed_[index(r, c)] += u[at(r)] * p[at(c)] + p[at(r)] * u[at(c)];
  }

 private:
  static constexpr std::size_t at(int i) { return static_cast<std::size_t>(i); }
  static constexpr std::size_t index(int r, int c) {
    const auto low = static_cast<std::size_t>(r < c ? r : c), high = static_cast<std::size_t>(r < c ? c : r);
    return high * (high + 1) / 2 + low;
  }

  int size_ = 0;
  std::array<Scalar, static_cast<std::size_t>(kMost) * (static_cast<std::size_t>(kMost) + 1) / 2> packed_{};
};

}  // namespace tetap::filter
