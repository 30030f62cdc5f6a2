// SPDX-License-Identifier: Apache-2.0
// Joseph's form of the covariance update: positive for any gain, optimal or not (Bucy & Joseph 1968; Bar-Shalom, Li,
// Kirubarajan 2001, eq. 5.2.3-18).
#pragma once

#include "tetap/filter/inverse.hpp"
#include "tetap/filter/kalman_form.hpp"
#include "tetap/filter/whole_covariance.hpp"

namespace tetap::filter {

/// Implements docs/explanation/kalman_forms.md (3).
/// (I - K H) P (I - K H)^T + K R K^T, R = diag(noise).
template <class Scalar, int N, int M>
[[nodiscard]] Symmetric<Scalar, N> joseph_update(const Symmetric<Scalar, N>& p, const Matrix<Scalar, N, M>& gain,
                                                 const Matrix<Scalar, M, N>& h, const Vector<Scalar, M>& noise) {
  Matrix<Scalar, N, N> left = Matrix<Scalar, N, N>::Identity();
  left -= gain.lazyProduct(h);
  Symmetric<Scalar, N> krk;
  for (int c = 0; c < N; ++c)
    for (int r = 0; r <= c; ++r)
      for (int m = 0; m < M; ++m) krk(r, c) += gain(r, m) * noise(m) * gain(c, m);
  return filter::propagate(p, left, krk);
}

template <class Scalar, int N>
class Joseph : public WholeCovariance<Scalar, N> {
 public:
  using WholeCovariance<Scalar, N>::WholeCovariance;

  template <int M>
  [[nodiscard]] Update<Scalar, N, M> update(const Matrix<Scalar, M, N>& h, const Vector<Scalar, M>& nu,
                                            const Vector<Scalar, M>& noise, Scalar gate) {
    Update<Scalar, N, M> result;
    Innovation<Scalar, M>& record = result.innovation;
    record.nu = nu;
    record.s = innovation_covariance(p_, h, noise);
    record.gate = gate;
    const Inverse<Scalar, M> inverse = inverse_of(record.s);
    if (!inverse.positive) {
      record.verdict = record.s.bounded() ? Verdict::kSingular : Verdict::kNotFinite;
      return result;
    }
    const Vector<Scalar, M> weighted = inverse.value.dense().lazyProduct(nu);
    record.nis = nu.dot(weighted);
    judge(record, gate);
    if (record.verdict != Verdict::kAccepted) return result;
    const Matrix<Scalar, N, M> cross = p_.dense().lazyProduct(h.transpose());
    const Matrix<Scalar, N, M> gain = cross.lazyProduct(inverse.value.dense());
    result.dx = cross.lazyProduct(weighted);
    p_ = joseph_update(p_, gain, h, noise);
    return result;
  }

 private:
  using WholeCovariance<Scalar, N>::p_;
};

template <State S>
using JosephKalman = FormedKalman<S, Joseph<typename S::Scalar, S::kErrors>>;

}  // namespace tetap::filter
