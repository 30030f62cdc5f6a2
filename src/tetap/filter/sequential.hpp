// SPDX-License-Identifier: Apache-2.0
// Components of a measurement one after another, each a scalar: no matrix is inverted (Simon 2006, sec. 6.1).
#pragma once

#include "tetap/filter/kalman_form.hpp"
#include "tetap/filter/whole_covariance.hpp"

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
      for (int c = 0; c < N; ++c)
        for (int r = 0; r <= c; ++r) p(r, c) -= ph(r) * (ph(c) * inverse);
    }
    judge(record, gate);
    if (record.verdict != Verdict::kAccepted) return result;
    p_ = p;
    result.dx = dx;
    return result;
  }

 private:
  using WholeCovariance<Scalar, N>::p_;
};

template <State S>
using SequentialKalman = FormedKalman<S, Sequential<typename S::Scalar, S::kErrors>>;

}  // namespace tetap::filter
