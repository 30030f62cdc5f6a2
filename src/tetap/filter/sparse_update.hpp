// SPDX-License-Identifier: Apache-2.0
// The update of filter/update.hpp for many states: the same equations, with the touched states as constants. Every
// index is then a constant, too. A measurement may see a group of states as they are: its first columns are the
// identity. The group's columns of P are then taken without a product.
#pragma once

#include "tetap/base/multiply_add.hpp"
#include "tetap/filter/unroll.hpp"
#include "tetap/filter/update.hpp"

namespace tetap::filter {

/// A measurement model that declares the first kDimension columns of its Jacobian to be the identity. If it has more,
/// has_rest() is true where they are other than zero this time.
template <class Measurement>
concept Direct = requires {
  requires Measurement::kDirect;
};

/// Share of a variance that an update leaves (at least noise over S): below it P has few right digits.
inline constexpr float kSharp = 1e-3F;

template <class Scalar, int N, int M>
struct SparseUpdate {
  Innovation<Scalar, M> innovation;
  Vector<Scalar, N> dx;  ///< error-state correction; nothing unless accepted
  bool sharp = false;    ///< some component is that much better than its prediction
};

/// Watch over an update on its way: none. Others have innovation(l, y, record) before the gate's verdict, with
/// S = L L^T and y = L^-1 nu, and gains(g) of a measurement that is used, with G = P H^T L^-T.
struct Unwatched {
  [[gnu::always_inline]] static void innovation(const auto&, const auto&, const auto&) {}
  [[gnu::always_inline]] static void gains(const auto&) {}
};

/// H of a group of states as they are.
struct IdentityJacobian {
  [[nodiscard]] constexpr float operator()(int m, int k) const { return m == k ? 1.0F : 0.0F; }
};

namespace detail {

/// The columns of P H^T, then of G: row n is m = 0 ... M - 1 in a row.
template <class Scalar, int N, int M>
struct Gains {
  std::array<Scalar, static_cast<std::size_t>(N) * M> value;
  [[gnu::always_inline]] constexpr Scalar& operator()(int n, int m) { return value[at(n, m)]; }
  [[gnu::always_inline]] constexpr const Scalar& operator()(int n, int m) const { return value[at(n, m)]; }

 private:
  [[gnu::always_inline]] static constexpr std::size_t at(int n, int m) {
    return static_cast<std::size_t>(n) * M + static_cast<std::size_t>(m);
  }
};

/// P -= G G^T, in tiles of three columns by one row that are read into registers first. P and G are both floats in
/// memory: after every store the compiler would have to read G again. One copy for all models.
template <class Scalar, int N, int M>
[[gnu::noinline]] void subtract(Symmetric<Scalar, N>& p, const Gains<Scalar, N, M>& g) {
  constexpr int kWide = 3;
  unroll<0, (N + kWide - 1) / kWide>([&](auto tile) __attribute__((always_inline)) {
    constexpr int kBegin = tile * kWide, kEnd = kBegin + kWide < N ? kBegin + kWide : N;
    std::array<Scalar, kWide * M> column;
    unroll<0, (kEnd - kBegin) * M>([&](auto i) __attribute__((always_inline)) {
      column[static_cast<std::size_t>(i)] = g(kBegin + i / M, i % M);
    });
    unroll<0, kEnd>([&](auto r) __attribute__((always_inline)) {
      constexpr int kFrom = r < kBegin ? kBegin : int{r};
      std::array<Scalar, M> row;
      unroll<0, M>([&](auto m) __attribute__((always_inline)) { row[static_cast<std::size_t>(m)] = g(r, m); });
      std::array<Scalar, kWide> sum;
      unroll<kFrom, kEnd>([&](auto c) __attribute__((always_inline)) {
        Scalar rest = p(r, c);
        unroll<0, M>([&](auto m) __attribute__((always_inline)) {
          rest = base::subtract_product(rest, row[static_cast<std::size_t>(m)],
                                        column[static_cast<std::size_t>(c - kBegin) * M + static_cast<std::size_t>(m)]);
        });
        sum[static_cast<std::size_t>(c - kBegin)] = rest;
      });
      unroll<kFrom, kEnd>([&](auto c)
                              __attribute__((always_inline)) { p(r, c) = sum[static_cast<std::size_t>(c - kBegin)]; });
    });
  });
}

/// From P H^T and S to the verdict, the correction and the new P. P H^T is in g, or it is the columns of P from kGroup.
template <int kGroup, class Scalar, int N, int M, class Watch>
[[gnu::noinline]] void correct(Symmetric<Scalar, N>& p, Gains<Scalar, N, M>& g, const Vector<Scalar, M>& noise,
                               SparseUpdate<Scalar, N, M>& result, Watch& watch) {
  Innovation<Scalar, M>& record = result.innovation;
  Symmetric<Scalar, M> l;  // l(i, j), i < j, is L_ji; the diagonal holds 1 / L_jj
  Vector<Scalar, M> y;
#pragma GCC unroll 16
  for (int j = 0; j < M; ++j) {
#pragma GCC unroll 16
    for (int i = 0; i < j; ++i) {
      Scalar sum = record.s(i, j);
#pragma GCC unroll 16
      for (int k = 0; k < i; ++k) sum = base::subtract_product(sum, l(k, i), l(k, j));
      l(i, j) = sum * l(i, i);
    }
    Scalar pivot = record.s(j, j);
#pragma GCC unroll 16
    for (int k = 0; k < j; ++k) pivot = base::subtract_product(pivot, l(k, j), l(k, j));
    if (!(pivot > Scalar{0}) || !(pivot < Scalar{1e30F})) {
      record.verdict = pivot <= Scalar{0} ? Verdict::kSingular : Verdict::kNotFinite;
      return;
    }
    l(j, j) = Scalar{1} / base::sqrt(pivot);
    Scalar sum = record.nu(j);
#pragma GCC unroll 16
    for (int k = 0; k < j; ++k) sum = base::subtract_product(sum, l(k, j), Scalar{y(k)});
    y(j) = sum * l(j, j);
  }
  record.nis = y.dot(y);
  if (!(record.nis < Scalar{1e30F})) return;  // NaN or beyond every gate: kNotFinite
  watch.innovation(l, y, record);
  if (!(record.nis <= record.gate)) {
    record.verdict = Verdict::kRejected;
    return;
  }
  record.verdict = Verdict::kAccepted;

  unroll<0, N>([&](auto n) __attribute__((always_inline)) {
    Scalar dx;
    unroll<0, M>([&](auto j) __attribute__((always_inline)) {
      Scalar gain = kGroup < 0 ? g(n, j) : p(n, kGroup < 0 ? 0 : kGroup + j);
      unroll<0, j>([&](auto k)
                       __attribute__((always_inline)) { gain = base::subtract_product(gain, g(n, k), l(k, j)); });
      gain *= l(j, j);
      g(n, j) = gain;
      dx = j == 0 ? gain * y(0) : base::add_product(dx, gain, Scalar{y(int{j})});
    });
    result.dx(int{n}) = dx;
  });
  watch.gains(g);
  subtract(p, g);
#pragma GCC unroll 16
  for (int m = 0; m < M; ++m) result.sharp = result.sharp || noise(m) <= kSharp * record.s(m, m);
  if (!result.sharp) return;
  for (int c = 0; c < N; ++c) {  // a variance never falls below the rounding error of what it was, as in update()
    Scalar was = p(c, c) > Scalar{0} ? p(c, c) : Scalar{0};
    for (int m = 0; m < M; ++m) was += g(c, m) * g(c, m);
    if (!(p(c, c) > was * Scalar{2.4e-7F})) p(c, c) = was * Scalar{2.4e-7F};
  }
}

}  // namespace detail

/// The measurement is a group of states as they are: H is the identity over the first kDimension of kTouches, which lie
/// in a row. H has nothing else (Direct, and has_rest() false). `result` begins as constructed.
template <class Measurement, class Scalar, int N, class Watch>
inline void group_update(Symmetric<Scalar, N>& p, const Vector<Scalar, Measurement::kDimension>& nu,
                         const Vector<Scalar, Measurement::kDimension>& noise, Scalar gate,
                         SparseUpdate<Scalar, N, Measurement::kDimension>& result, Watch& watch) {
  constexpr int kM = Measurement::kDimension, kGroup = Measurement::kTouches[0];
  static_assert(Direct<Measurement> && Measurement::kTouches[kM - 1] == kGroup + kM - 1);
  result.innovation.nu = nu;
  result.innovation.gate = gate;
#pragma GCC unroll 16
  for (int c = 0; c < kM; ++c)
#pragma GCC unroll 16
    for (int r = 0; r <= c; ++r)
      result.innovation.s(r, c) = p(kGroup + r, kGroup + c) + (r == c ? noise(c) : Scalar{0});
  detail::Gains<Scalar, N, kM> g;
  if constexpr (std::is_same_v<Watch, Unwatched>) {
    detail::correct<kGroup>(p, g, noise, result, watch);
  } else {  // an image has one correction of kM components, not one of each group
    unroll<0, N>([&](auto n) __attribute__((always_inline)) {
      unroll<0, kM>([&](auto m) __attribute__((always_inline)) { g(n, m) = p(n, kGroup + m); });
    });
    detail::correct<-1>(p, g, noise, result, watch);
  }
}

/// Does as update(), over the states that Measurement::kTouches names. `result` begins as constructed.
template <class Measurement, class Scalar, int N, class Watch>
inline void sparse_update(
    Symmetric<Scalar, N>& p,
    const Matrix<Scalar, Measurement::kDimension, static_cast<int>(Measurement::kTouches.size())>& h,
    const Vector<Scalar, Measurement::kDimension>& nu, const Vector<Scalar, Measurement::kDimension>& noise,
    Scalar gate, SparseUpdate<Scalar, N, Measurement::kDimension>& result, Watch& watch) {
  constexpr int kM = Measurement::kDimension, kK = static_cast<int>(Measurement::kTouches.size());
  constexpr int kFirst = Direct<Measurement> ? kM : 0;  // columns before are the identity
  constexpr auto touch = [](int k) { return Measurement::kTouches[static_cast<std::size_t>(k)]; };
  const auto at = [&](int m, int k) { return h(m, k); };
  Innovation<Scalar, kM>& record = result.innovation;
  record.nu = nu;
  record.gate = gate;

  detail::Gains<Scalar, N, kM> g;
  unroll<0, N>([&](auto n) __attribute__((always_inline)) {
    unroll<0, kM>([&](auto m) __attribute__((always_inline)) {
      Scalar sum = kFirst > 0 ? p(n, touch(m)) : at(m, 0) * p(n, touch(0));
      unroll<(kFirst > 0 ? kFirst : 1), kK>([&](auto k) __attribute__((always_inline)) {
        sum = base::add_product(sum, Scalar{at(m, k)}, p(n, touch(k)));
      });
      g(n, m) = sum;
    });
  });
  unroll<0, kM>([&](auto c) __attribute__((always_inline)) {
    unroll<0, c + 1>([&](auto r) __attribute__((always_inline)) {
      Scalar sum = r == c ? noise(int{c}) : Scalar{0};
      if constexpr (kFirst > 0) sum += g(touch(r), c);
      unroll<kFirst, kK>([&](auto k) __attribute__((always_inline)) {
        sum = base::add_product(sum, Scalar{at(r, k)}, g(touch(k), c));
      });
      record.s(r, c) = sum;
    });
  });
  detail::correct<-1>(p, g, noise, result, watch);
}

}  // namespace tetap::filter
