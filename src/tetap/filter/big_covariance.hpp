// SPDX-License-Identifier: Apache-2.0
// A covariance of many states of which some are in use: states are added and removed at run time, updates are of low
// rank. Only the upper half exists, packed by columns, so that a new state is a new column at the end.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/base/multiply_add.hpp"

#include <array>
#include <cstddef>

namespace tetap::filter {

template <class Scalar_, int kMost_>
class BigCovariance {
 public:
  using Scalar = Scalar_;
  static constexpr int kMost = kMost_;
  /// A number for each state in use.
  using States = std::array<Scalar, static_cast<std::size_t>(kMost)>;
  /// kWidth numbers for each state in use, those of one state side by side.
  template <std::size_t kWidth>
  using Rows = std::array<std::array<Scalar, kWidth>, static_cast<std::size_t>(kMost)>;

  [[nodiscard]] int size() const { return size_; }
  [[nodiscard]] bool full() const { return size_ == kMost; }
  /// Number of covariances in use, and one of them: the upper half by columns.
  [[nodiscard]] std::size_t words() const { return index(0, size_); }
  [[nodiscard]] Scalar word(std::size_t i) const { return packed_[i]; }
  [[nodiscard]] Scalar operator()(int r, int c) const { return packed_[index(r, c)]; }
  [[nodiscard]] Scalar& operator()(int r, int c) { return packed_[index(r, c)]; }
  void clear() { size_ = 0; }
  /// The first `count` states in use, independent.
  void begin(const States& variances, int count = kMost) {
    size_ = count;
    for (Scalar& word : packed_) word = Scalar{0};
    for (int n = 0; n < count; ++n) packed_[index(n, n)] = variances[at(n)];
  }

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

  /// The errors of `count` states from `to` become those of the states from `from`: P = T P T^T by copying. The two
  /// groups do not overlap.
  void copy(int from, int to, int count) {
    for (int k = 0; k < count; ++k)
      for (int n = 0; n < size_; ++n)
        if (n < to || n >= to + count) packed_[index(n, to + k)] = packed_[index(n, from + k)];
    for (int k = 0; k < count; ++k)
      for (int j = 0; j <= k; ++j) packed_[index(to + j, to + k)] = packed_[index(from + j, from + k)];
  }
  /// The error of state `to` gains `share` times that of state `from`, another one.
  void add_share(int to, Scalar share, int from) {
    const Scalar before = packed_[index(to, from)], whole = packed_[index(from, from)];
    for (int n = 0; n < size_; ++n)
      if (n != to) packed_[index(n, to)] = base::add_product(packed_[index(n, to)], share, packed_[index(n, from)]);
    packed_[index(to, to)] += share * (before + before + share * whole);
  }

  /// P H^T in columns `column` to column + kRows - 1 of `product`, for kRows rows of H. The rows are zero but at the
  /// first kHead states and at kTail states from `tail` on. Row r of rows holds the head's elements, then the tail's.
  template <int kRows, int kHead, int kTail, std::size_t kWidth>
  void times(const std::array<std::array<Scalar, static_cast<std::size_t>(kHead + kTail)>, kRows>& rows, int tail,
             Rows<kWidth>& product, int column) const {
    const auto h = rows;  // a copy that no store to the product can change
    std::array<Scalar, static_cast<std::size_t>(kHead + kTail)> p;
    const auto scattered = [&](int begin, int end) {
      for (int n = begin; n < end; ++n) {
        for (int k = 0; k < kHead; ++k) p[at(k)] = packed_[index(n, k)];
        for (int t = 0; t < kTail; ++t) p[at(kHead + t)] = packed_[index(n, tail + t)];
        put<kRows>(h, p, &product[at(n)][at(column)]);
      }
    };
    scattered(0, kHead);
    const Scalar* own = &packed_[index(0, kHead)];
    const Scalar* const across = &packed_[index(0, tail)];
    for (int n = kHead; n < tail; own += ++n) {  // the tail's columns are long enough
#pragma GCC unroll 8
      for (int k = 0; k < kHead; ++k) p[at(k)] = own[k];
#pragma GCC unroll 8
      for (int t = 0; t < kTail; ++t) p[at(kHead + t)] = across[n + t * tail + t * (t + 1) / 2];
      put<kRows>(h, p, &product[at(n)][at(column)]);
    }
    scattered(tail, tail + kTail);
    if (tail + kTail >= size_) return;
    own = &packed_[index(0, tail + kTail)];
    for (int n = tail + kTail; n < size_; own += ++n) {  // their own columns are
#pragma GCC unroll 8
      for (int k = 0; k < kHead; ++k) p[at(k)] = own[k];
#pragma GCC unroll 8
      for (int t = 0; t < kTail; ++t) p[at(kHead + t)] = own[tail + t];
      put<kRows>(h, p, &product[at(n)][at(column)]);
    }
  }

  /// P = F P F^T + Q where F is the identity but for `swing`. `swing` holds the shares of the error of head state
  /// kHead - 1 in those of the head states before it. Q is zero but in the head (upper half of q is read).
  template <int kHead>
  void predict_head(const std::array<Scalar, kHead - 1>& swing, const std::array<std::array<Scalar, kHead>, kHead>& q) {
    constexpr int kLast = kHead - 1;
    for (int c = kHead; c < size_; ++c) {
      Scalar* const column = &packed_[index(0, c)];
#pragma GCC unroll 8
      for (int r = 0; r < kLast; ++r) column[r] = base::add_product(column[r], swing[at(r)], column[kLast]);
    }
    for (int c = 0; c < kLast; ++c)
      for (int r = 0; r <= c; ++r)
        packed_[index(r, c)] += swing[at(r)] * packed_[index(c, kLast)] + swing[at(c)] * packed_[index(r, kLast)] +
                                swing[at(r)] * swing[at(c)] * packed_[index(kLast, kLast)];
    for (int r = 0; r < kLast; ++r) packed_[index(r, kLast)] += swing[at(r)] * packed_[index(kLast, kLast)];
    for (int c = 0; c < kHead; ++c)
      for (int r = 0; r <= c; ++r) packed_[index(r, c)] += q[at(r)][at(c)];
  }

  /// P = P - G G^T + u b^T + b u^T in one pass over P. Columns 0 and 1 of w are u and b, the next kRank are G.
  template <int kRank, std::size_t kWidth>
  void correct(const Rows<kWidth>& w) {
    static_assert(static_cast<std::size_t>(kRank) + 2 <= kWidth);
    int c = 0;
    for (; c + 1 < size_; c += 2) {  // two columns at a time share what is loaded of each row
      const Coefficients<kRank> left(w[at(c)]), right(w[at(c + 1)]);
      Scalar* const low = &packed_[index(0, c)];
      Scalar* const high = &packed_[index(0, c + 1)];
      for (int r = 0; r <= c; ++r) {
        const auto& row = w[at(r)];
        Scalar a = low[r], b = high[r];
        a = base::add_product(a, row[0], left.value[0]);
        b = base::add_product(b, row[0], right.value[0]);
        a = base::add_product(a, row[1], left.value[1]);
        b = base::add_product(b, row[1], right.value[1]);
#pragma GCC unroll 16
        for (std::size_t k = 2; k < kRank + 2; ++k) {
          a = base::subtract_product(a, row[k], left.value[k]);
          b = base::subtract_product(b, row[k], right.value[k]);
        }
        low[r] = a;
        high[r] = b;
      }
      high[c + 1] = right.squared_to(high[c + 1]);
    }
    if (c == size_) return;
    const Coefficients<kRank> only(w[at(c)]);
    Scalar* const column = &packed_[index(0, c)];
    for (int r = 0; r <= c; ++r) column[r] = only.added_to(column[r], w[at(r)]);
  }

  /// P = P - G G^T, G in columns `first` to first + kRank - 1 of g. A variance keeps the rounding error of what it was.
  template <int kRank, std::size_t kWidth>
  void subtract(const Rows<kWidth>& g, int first) {
    const auto held = [](Scalar after, Scalar before) {
      const Scalar floor = before * Scalar(2.4e-7F);
      return after > floor ? after : floor;
    };
    int c = 0;
    for (; c + 1 < size_; c += 2) {  // two columns at a time share what is loaded of each row
      const auto left = taken<kRank>(g, c, first), right = taken<kRank>(g, c + 1, first);
      Scalar* const low = &packed_[index(0, c)];
      Scalar* const high = &packed_[index(0, c + 1)];
      const Scalar before_low = low[c], before_high = high[c + 1];
      for (int r = 0; r <= c; ++r) {
        const Scalar* const row = &g[at(r)][at(first)];
        low[r] = less<kRank>(low[r], left, row);
        high[r] = less<kRank>(high[r], right, row);
      }
      low[c] = held(low[c], before_low);
      high[c + 1] = held(less<kRank>(high[c + 1], right, right.data()), before_high);
    }
    if (c == size_) return;
    const auto only = taken<kRank>(g, c, first);
    Scalar* const column = &packed_[index(0, c)];
    const Scalar before = column[c];
    for (int r = 0; r <= c; ++r) column[r] = less<kRank>(column[r], only, &g[at(r)][at(first)]);
    column[c] = held(column[c], before);
  }

  /// Adds a share of each variance to itself.
  void inflate(Scalar share) {
    std::size_t i = 0;
    for (int n = 0; n < size_; i += static_cast<std::size_t>(++n) + 1) packed_[i] += share * packed_[i];
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

  /// P = T P T^T where T turns each pair of states from `first` on: (x, y) becomes (c x - s y, s x + c y).
  void turn_pairs(int first, Scalar c, Scalar s) {
    for (int pair = first; pair + 1 < size_; pair += 2) {
      for (int n = 0; n < size_; ++n) {
        if (n == pair || n == pair + 1) continue;
        const Scalar x = packed_[index(n, pair)], y = packed_[index(n, pair + 1)];
        packed_[index(n, pair)] = c * x - s * y;
        packed_[index(n, pair + 1)] = s * x + c * y;
      }
      const Scalar xx = packed_[index(pair, pair)], xy = packed_[index(pair, pair + 1)],
                   yy = packed_[index(pair + 1, pair + 1)];
      packed_[index(pair, pair)] = c * c * xx - 2 * c * s * xy + s * s * yy;
      packed_[index(pair, pair + 1)] = c * s * (xx - yy) + (c * c - s * s) * xy;
      packed_[index(pair + 1, pair + 1)] = s * s * xx + 2 * c * s * xy + c * c * yy;
    }
  }

  static constexpr auto members(auto& self) {
    return base::members(self.size_, base::first(self.packed_, self.words()));
  }

 private:
  /// Factors of the rows of w for one column: b, u, G.
  template <int kRank>
  struct Coefficients {
    std::array<Scalar, static_cast<std::size_t>(kRank) + 2> value;
    template <std::size_t kWidth>
    explicit Coefficients(const std::array<Scalar, kWidth>& row) {
      value[0] = row[1];
      value[1] = row[0];
#pragma GCC unroll 16
      for (std::size_t k = 2; k < kRank + 2; ++k) value[k] = row[k];
    }
    /// The column's own diagonal element.
    [[nodiscard]] Scalar squared_to(Scalar sum) const {
      sum = base::add_product(sum, value[1], value[0]);
      sum = base::add_product(sum, value[0], value[1]);
#pragma GCC unroll 16
      for (std::size_t k = 2; k < kRank + 2; ++k) sum = base::subtract_product(sum, value[k], value[k]);
      return sum;
    }
    template <std::size_t kWidth>
    [[nodiscard]] Scalar added_to(Scalar sum, const std::array<Scalar, kWidth>& row) const {
      sum = base::add_product(sum, row[0], value[0]);
      sum = base::add_product(sum, row[1], value[1]);
#pragma GCC unroll 16
      for (std::size_t k = 2; k < kRank + 2; ++k) sum = base::subtract_product(sum, row[k], value[k]);
      return sum;
    }
  };

  /// kRank elements of a row of g.
  template <int kRank, std::size_t kWidth>
  static std::array<Scalar, static_cast<std::size_t>(kRank)> taken(const Rows<kWidth>& g, int row, int first) {
    std::array<Scalar, static_cast<std::size_t>(kRank)> value;
#pragma GCC unroll 16
    for (int k = 0; k < kRank; ++k) value[at(k)] = g[at(row)][at(first + k)];
    return value;
  }
  template <int kRank>
  static Scalar less(Scalar sum, const std::array<Scalar, static_cast<std::size_t>(kRank)>& a, const Scalar* b) {
#pragma GCC unroll 16
    for (int k = 0; k < kRank; ++k) sum = base::subtract_product(sum, a[at(k)], b[k]);
    return sum;
  }
  /// kRows sums of h times p, side by side.
  template <int kRows, class H, std::size_t kElements>
  static void put(const H& h, const std::array<Scalar, kElements>& p, Scalar* to) {
#pragma GCC unroll 4
    for (std::size_t r = 0; r < kRows; ++r) {
      Scalar sum = h[r][0] * p[0];
#pragma GCC unroll 8
      for (std::size_t k = 1; k < kElements; ++k) sum = base::add_product(sum, h[r][k], p[k]);
      to[r] = sum;
    }
  }
  static constexpr std::size_t at(int i) { return static_cast<std::size_t>(i); }
  static constexpr std::size_t index(int r, int c) {
    const auto low = static_cast<std::size_t>(r < c ? r : c), high = static_cast<std::size_t>(r < c ? c : r);
    return high * (high + 1) / 2 + low;
  }

  int size_ = 0;
  std::array<Scalar, static_cast<std::size_t>(kMost) * (static_cast<std::size_t>(kMost) + 1) / 2> packed_{};
};

}  // namespace tetap::filter
