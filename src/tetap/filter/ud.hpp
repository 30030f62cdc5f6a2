// SPDX-License-Identifier: Apache-2.0
// P = U D U^T, U unit upper triangular, D diagonal: the digits of a square root without its square roots. Measurement
// update: Bierman 1977, ch. V; time update by weighted Gram-Schmidt: Thornton 1976 (Bierman 1977, ch. VI).
#pragma once

#include "tetap/filter/kalman_form.hpp"

namespace tetap::filter {

template <class Scalar, int N>
class Ud {
 public:
  /// Implements docs/explanation/kalman_forms.md (5).
  /// A pivot that is not above zero gives a column of zeros.
  explicit Ud(Symmetric<Scalar, N> p) {
    for (int j = N - 1; j >= 0; --j) {
      if (!(p(j, j) > Scalar{0})) continue;
      d_(j) = p(j, j);
      for (int i = 0; i < j; ++i) u_(i, j) = p(i, j) / d_(j);
      for (int c = 0; c < j; ++c)
        for (int r = 0; r <= c; ++r) p(r, c) -= u_(r, j) * d_(j) * u_(c, j);
    }
  }

  [[nodiscard]] Symmetric<Scalar, N> covariance() const {
    Symmetric<Scalar, N> p;
    for (int c = 0; c < N; ++c)
      for (int r = 0; r <= c; ++r)
        for (int k = c; k < N; ++k) p(r, c) += u_(r, k) * d_(k) * u_(c, k);
    return p;
  }
  [[nodiscard]] const Matrix<Scalar, N, N>& u() const { return u_; }
  [[nodiscard]] const Vector<Scalar, N>& d() const { return d_; }

  /// Implements docs/explanation/kalman_forms.md (6).
  /// Rows of [F U, U_q] are made orthogonal under the weights [D, D_q], from the last one up.
  bool propagate(const Matrix<Scalar, N, N>& f, const Symmetric<Scalar, N>& q) {
    const Ud noise(q);
    Matrix<Scalar, N, 2 * N> w;
    w.template leftCols<N>() = f.lazyProduct(u_);
    w.template rightCols<N>() = noise.u_;
    Vector<Scalar, 2 * N> weight;
    weight << d_, noise.d_;
    Ud next(Symmetric<Scalar, N>{});
    for (int j = N - 1; j >= 0; --j) {
      const Vector<Scalar, 2 * N> weighted = w.row(j).transpose().cwiseProduct(weight);
      const Scalar d = w.row(j).dot(weighted.transpose());
      if (!(d >= Scalar{0}) || !(d < Scalar(1e30F))) return false;
      next.d_(j) = d;
      if (!(d > Scalar{0})) continue;
      const Scalar inverse = Scalar{1} / d;
      for (int i = 0; i < j; ++i) {
        next.u_(i, j) = w.row(i).dot(weighted.transpose()) * inverse;
        w.row(i) -= next.u_(i, j) * w.row(j);
      }
    }
    if (!next.covariance().bounded()) return false;
    *this = next;
    return true;
  }

  template <int M>
  [[nodiscard]] Update<Scalar, N, M> update(const Matrix<Scalar, M, N>& h, const Vector<Scalar, M>& nu,
                                            const Vector<Scalar, M>& noise, Scalar gate) {
    Update<Scalar, N, M> result;
    Innovation<Scalar, M>& record = result.innovation;
    record.nu = nu;
    record.s = innovation_covariance(covariance(), h, noise);
    record.gate = gate;
    Ud next = *this;
    Vector<Scalar, N> dx = Vector<Scalar, N>::Zero();
    for (int m = 0; m < M; ++m) {
      const Vector<Scalar, N> row = h.row(m).transpose();
      Vector<Scalar, N> gain;
      const Scalar s = next.absorb(row, noise(m), gain);
      if (!(s > Scalar{0}) || !(s < Scalar(1e30F))) {
        record.verdict = s <= Scalar{0} ? Verdict::kSingular : Verdict::kNotFinite;
        return result;
      }
      const Scalar left = nu(m) - row.dot(dx);
      record.nis += left * left / s;
      dx += gain * (left / s);
    }
    judge(record, gate);
    if (record.verdict != Verdict::kAccepted) return result;
    *this = next;
    result.dx = dx;
    return result;
  }

 private:
  /// Implements docs/explanation/kalman_forms.md (7).
  /// One scalar with row h and variance r. Gives S; `gain` is K S.
  Scalar absorb(const Vector<Scalar, N>& h, Scalar r, Vector<Scalar, N>& gain) {
    const Vector<Scalar, N> f = u_.transpose().lazyProduct(h);
    const Vector<Scalar, N> v = d_.cwiseProduct(f);
    gain.setZero();
    Scalar alpha = r;
    for (int j = 0; j < N; ++j) {
      const Scalar before = alpha;
      alpha += f(j) * v(j);
      if (!(before > Scalar{0}) || !(alpha > Scalar{0})) return before > Scalar{0} ? alpha : before;
      d_(j) *= before / alpha;
      const Scalar turn = -f(j) / before;
      for (int i = 0; i < j; ++i) {
        const Scalar u = u_(i, j);
        u_(i, j) = u + gain(i) * turn;
        gain(i) += u * v(j);
      }
      gain(j) = v(j);
    }
    return alpha;
  }

  Matrix<Scalar, N, N> u_ = Matrix<Scalar, N, N>::Identity();
  Vector<Scalar, N> d_ = Vector<Scalar, N>::Zero();
};

template <State S>
using UdKalman = FormedKalman<S, Ud<typename S::Scalar, S::kErrors>>;

}  // namespace tetap::filter
