// SPDX-License-Identifier: Apache-2.0
// A Kalman filter, linear or extended, whose covariance has the form that its type names: joseph.hpp, sequential.hpp,
// ud.hpp, square_root.hpp. The forms are equal in exact arithmetic; they differ in cost and in what rounding does to P.
#pragma once

#include "tetap/filter/state.hpp"
#include "tetap/filter/update.hpp"

#include <concepts>

namespace tetap::filter {

/// A form is made from a covariance and gives it back; propagate() and update() change it only when they succeed.
/// propagate(F, Q): F P F^T + Q. update(H, nu, variances, gate): as filter::update(), with all N columns of H.
template <class Form, class Scalar, int N>
concept CovarianceForm = std::constructible_from<Form, Symmetric<Scalar, N>> &&
    requires(Form& form, const Form& given, const Matrix<Scalar, N, N>& f, const Symmetric<Scalar, N>& q,
             const Matrix<Scalar, 1, N>& h, const Vector<Scalar, 1>& one, Scalar gate) {
  { given.covariance() } -> std::same_as<Symmetric<Scalar, N>>;
  { form.propagate(f, q) } -> std::same_as<bool>;
  { form.template update<1>(h, one, one, gate) } -> std::same_as<Update<Scalar, N, 1>>;
};

template <State State_, CovarianceForm<typename State_::Scalar, State_::kErrors> Form>
class FormedKalman {
 public:
  using State = State_;
  using Scalar = typename State::Scalar;
  static constexpr int kErrors = State::kErrors;

  State x{};
  Form p{Symmetric<Scalar, kErrors>{}};

  [[nodiscard]] Symmetric<Scalar, kErrors> covariance() const { return p.covariance(); }
  void set_covariance(const Symmetric<Scalar, kErrors>& covariance) { p = Form(covariance); }

  /// Implements docs/explanation/kalman_forms.md (1).
  /// x = f(x), P = F P F^T + Q. False, and nothing has changed, when either would be no number.
  template <LinearisedMotion<State> Motion>
  bool predict(const Motion& motion) {
    const State next = motion.predict(x);
    const Symmetric<Scalar, kErrors> q = motion.noise(x);
    if (!next.finite() || !q.no_variance_below_zero()) return false;
    if (!p.propagate(motion.jacobian(x), q)) return false;
    x = next;
    return true;
  }

  /// Joint gate, then the correction; a measurement that is rejected changes nothing.
  template <LinearisedModel<State> Measurement>
  [[nodiscard]] Innovation<Scalar, Measurement::kDimension> update(const Measurement& z, Scalar gate) {
    const auto columns = z.jacobian(x);
    Matrix<Scalar, Measurement::kDimension, kErrors> h = Matrix<Scalar, Measurement::kDimension, kErrors>::Zero();
    for (std::size_t k = 0; k < Measurement::kTouches.size(); ++k)
      h.col(Measurement::kTouches[k]) = columns.col(static_cast<int>(k));
    const auto result = p.template update<Measurement::kDimension>(h, z.residual(z.predict(x)), z.noise(), gate);
    if (result.innovation.verdict == Verdict::kAccepted) x = x.plus(result.dx);
    return result.innovation;
  }
};

/// Implements docs/explanation/kalman_forms.md (2).
/// H P H^T + R.
template <class Scalar, int N, int M>
[[nodiscard]] Symmetric<Scalar, M> innovation_covariance(const Symmetric<Scalar, N>& p, const Matrix<Scalar, M, N>& h,
                                                         const Vector<Scalar, M>& noise) {
  const Matrix<Scalar, M, N> hp = h.lazyProduct(p.dense());
  Symmetric<Scalar, M> s;
  for (int c = 0; c < M; ++c)
    for (int r = 0; r <= c; ++r) s(r, c) = (r == c ? noise(c) : Scalar{0}) + hp.row(r).dot(h.row(c));
  return s;
}

/// Sets verdict and gate of a record whose NIS is known: NaN and beyond every gate is kNotFinite.
template <class Scalar, int M>
void judge(Innovation<Scalar, M>& record, Scalar gate) {
  record.gate = gate;
  if (!(record.nis < Scalar(1e30F)))
    record.verdict = Verdict::kNotFinite;
  else
    record.verdict = record.nis <= gate ? Verdict::kAccepted : Verdict::kRejected;
}

}  // namespace tetap::filter
