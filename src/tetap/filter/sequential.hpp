// SPDX-License-Identifier: Apache-2.0
// Components of a measurement one after another, each a scalar: no matrix is inverted (Simon 2006, sec. 6.1). P - K s
// K^T loses its digits where a measurement is far sharper than the state. Each variance is therefore rounded up by what
// the subtraction may lose, so P stays positive definite and is never too sure (Higham 2002, sec. 10.1).
#pragma once

#include "tetap/filter/kalman_form.hpp"
#include "tetap/filter/whole_covariance.hpp"

#include <limits>

namespace tetap::filter {

template <class Scalar, int N>
class Sequential : public WholeCovariance<Scalar, N> {
 public:
  using WholeCovariance<Scalar, N>::WholeCovariance;

  /// Implements docs/explanation/kalman_forms.md (4).
  /// The sum of the scalars' NIS is the joint NIS, because each takes the state that those before it have left.
  template <int M>
  [[nodiscard]] Update<Scalar, N, M> update(const Matrix<Scalar, M, N>& h, const Vector<Scalar, M>& nu,
                                            const Vector<Scalar, M>& noise, Scalar gate) {
    Update<Scalar, N, M> result;
    Innovation<Scalar, M>& record = result.innovation;
    record.nu = nu;
    record.s = innovation_covariance(p_, h, noise);
    record.gate = gate;
    Symmetric<Scalar, N> p = p_;
    Vector<Scalar, N> dx = Vector<Scalar, N>::Zero();
    for (int m = 0; m < M; ++m) {
      Vector<Scalar, N> ph;
      for (int n = 0; n < N; ++n) {
        Scalar sum = 0;
        for (int k = 0; k < N; ++k) sum += p(n, k) * h(m, k);
        ph(n) = sum;
      }
      const Scalar s = h.row(m).dot(ph.transpose()) + noise(m);
      if (!(s > Scalar{0}) || !(s < Scalar(1e30F))) {
        record.verdict = s <= Scalar{0} ? Verdict::kSingular : Verdict::kNotFinite;
        return result;
      }
      const Scalar inverse = Scalar{1} / s;
      const Scalar left = nu(m) - h.row(m).dot(dx.transpose());
      record.nis += left * left * inverse;
      dx += ph * (left * inverse);
      for (int c = 0; c < N; ++c) {
        const Scalar lost = kRounding * p(c, c);
        for (int r = 0; r <= c; ++r) p(r, c) -= ph(r) * (ph(c) * inverse);
        p(c, c) += lost;
      }
      // P+ h = P h r/s loses nothing: exact where h has one state.
      if (const int one = only_state(Vector<Scalar, N>(h.row(m).transpose())); one >= 0)
        for (int n = 0; n < N; ++n) p(n, one) = ph(n) * (noise(m) * inverse) / h(m, one);
    }
    judge(record, gate);
    if (record.verdict != Verdict::kAccepted) return result;
    p_ = p;
    result.dx = dx;
    return result;
  }

 private:
  using WholeCovariance<Scalar, N>::p_;
  static constexpr Scalar kRounding = Scalar(N) * std::numeric_limits<Scalar>::epsilon() / 2;

  /// The state that alone enters h, or -1.
  [[nodiscard]] static int only_state(const Vector<Scalar, N>& h) {
    int one = -1;
    for (int n = 0; n < N; ++n) {
      if (!(h(n) > Scalar{0} || h(n) < Scalar{0})) continue;
      if (one >= 0) return -1;
      one = n;
    }
    return one;
  }
};

template <State S>
using SequentialKalman = FormedKalman<S, Sequential<typename S::Scalar, S::kErrors>>;

}  // namespace tetap::filter
