// SPDX-License-Identifier: Apache-2.0
// One hypothesis of an additive fault beside a Kalman filter that knows nothing of it. A fault of size f moves the mean
// of the error e = truth - estimate by phi f; phi is the fault's signature (Friedland 1969, IEEE TAC 14(4)). The
// innovations give f, its variance and the evidence (Willsky & Jones 1976, IEEE TAC 21(1)). With prior f ~ N(0, s^2)
// the filter and its signature are the filter that has f as a state: P + phi phi^T / a, and cross-covariance phi / a.
#pragma once

#include "tetap/base/math.hpp"
#include "tetap/base/members.hpp"
#include "tetap/base/multiply_add.hpp"
#include "tetap/filter/symmetric.hpp"

#include <array>
#include <cstddef>

namespace tetap::filter {

/// v <- L^-1 v. Of `l` the upper half holds L transposed, and its diagonal 1 / L_jj, as in sparse_update.hpp.
template <class Scalar, int M>
[[gnu::always_inline]] inline void whiten(const Symmetric<Scalar, M>& l,
                                          std::array<Scalar, static_cast<std::size_t>(M)>& v) {
#pragma GCC unroll 4
  for (int j = 0; j < M; ++j) {
    Scalar sum = v[static_cast<std::size_t>(j)];
#pragma GCC unroll 4
    for (int k = 0; k < j; ++k) sum = base::subtract_product(sum, l(k, j), v[static_cast<std::size_t>(k)]);
    v[static_cast<std::size_t>(j)] = sum * l(j, j);
  }
}

template <class Scalar, int N>
class FaultSignature {
 public:
  using Errors = std::array<Scalar, N>;

  /// The fault begins now: it makes error `jumps` larger by its size, or (-1) it is a fault of a measurement.
  /// `largest` is the largest plausible size, 1 sigma.
  constexpr void begin(int jumps, Scalar largest) {
    phi = {};
    if (jumps >= 0) phi[static_cast<std::size_t>(jumps)] = Scalar{1};
    information = Scalar{1} / (largest * largest);
    weighted = Scalar{0};
    age_s = Scalar{0};
  }
  /// Takes an innovation: w = L^-1 (H phi + d) and y = L^-1 nu. `share` below 1 is for S that counts as S / share.
  template <std::size_t M>
  constexpr void score(const std::array<Scalar, M>& w, const std::array<Scalar, M>& y, Scalar share = Scalar{1}) {
    Scalar ww{0}, wy{0};
#pragma GCC unroll 4
    for (std::size_t j = 0; j < M; ++j) {
      ww += w[j] * w[j];
      wy += w[j] * y[j];
    }
    information += share * ww;
    weighted += share * wy;
  }
  [[nodiscard]] constexpr Scalar size() const { return weighted / information; }
  [[nodiscard]] constexpr Scalar variance() const { return Scalar{1} / information; }
  /// Twice the logarithm of the likelihood ratio to "no fault", for the prior N(0, largest^2).
  [[nodiscard]] Scalar evidence(Scalar largest) const {
    return weighted * size() - base::log(information * (largest * largest));
  }
  static constexpr auto members(auto& self) {
    return base::members(self.phi, self.information, self.weighted, self.age_s);
  }

  Errors phi{};           ///< per unit of the fault, in the filter's errors
  Scalar information{1};  ///< a: inverse of the size's variance
  Scalar weighted{0};     ///< b: size times information
  Scalar age_s{0};
};

/// A measurement was used, with gains G = P H^T L^-T: G(n, j) of error n. It moves the signatures from `first`
/// on, each by its own w; a gain is read once for all of them.
template <class Scalar, int N, std::size_t kCount, std::size_t M, class Gains>
[[gnu::always_inline]] inline void correct(FaultSignature<Scalar, N>* first,
                                           const std::array<std::array<Scalar, M>, kCount>& w, const Gains& gains) {
  for (int n = 0; n < N; ++n) {
    std::array<Scalar, M> gain;
#pragma GCC unroll 4
    for (std::size_t j = 0; j < M; ++j) gain[j] = gains(n, static_cast<int>(j));
#pragma GCC unroll 4
    for (std::size_t i = 0; i < kCount; ++i) {
      Scalar& phi = first[i].phi[static_cast<std::size_t>(n)];
#pragma GCC unroll 4
      for (std::size_t j = 0; j < M; ++j) phi = base::subtract_product(phi, gain[j], w[i][j]);
    }
  }
}

/// P += scale phi phi^T.
template <class Scalar, int N>
constexpr void add_outer(Symmetric<Scalar, N>& p, const std::array<Scalar, static_cast<std::size_t>(N)>& phi,
                         Scalar scale) {
  for (int c = 0; c < N; ++c) {
    const Scalar by = scale * phi[static_cast<std::size_t>(c)];
    for (int r = 0; r <= c; ++r) p(r, c) += by * phi[static_cast<std::size_t>(r)];
  }
}

}  // namespace tetap::filter
