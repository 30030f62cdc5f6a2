// SPDX-License-Identifier: Apache-2.0
// Iterated extended Kalman filter: the measurement is linearised again at each corrected state, which is Gauss-Newton
// on the posterior (Bell & Cathey 1993; Bar-Shalom, Li, Kirubarajan 2001, sec. 10.5.2).
#pragma once

#include "tetap/filter/ekf.hpp"

namespace tetap::filter {

/// kIterations linearisations after the first; prediction as in Ekf.
template <State State_, int kIterations = 3>
class IteratedEkf : public Ekf<State_> {
 public:
  using State = State_;
  using Scalar = typename State::Scalar;
  static constexpr int kErrors = State::kErrors;

  /// The first linearisation decides about the gate, and is what is recorded.
  template <LinearisedModel<State> Measurement>
  [[nodiscard]] Innovation<Scalar, Measurement::kDimension> update(const Measurement& z, Scalar gate) {
    constexpr auto kOpen = Scalar(1e30F);
    const State prior = this->x;
    auto posterior = this->p;
    auto result = correct_at(z, prior, Vector<Scalar, kErrors>::Zero(), posterior, gate);
    if (result.innovation.verdict != Verdict::kAccepted) return result.innovation;
    Vector<Scalar, kErrors> dx = result.dx;
    for (int i = 0; i < kIterations; ++i) {
      auto again = this->p;
      const auto next = correct_at(z, prior.plus(dx), dx, again, kOpen);
      if (next.innovation.verdict != Verdict::kAccepted || !prior.plus(next.dx).finite()) break;
      dx = next.dx;
      posterior = again;
    }
    this->x = prior.plus(dx);
    this->p = posterior;
    if (!well_conditioned(this->p)) restore(this->p);
    return result.innovation;
  }

 private:
  /// Implements docs/explanation/kalman_forms.md (10).
  /// Linearised at x = prior + dx, as a correction of the prior: nu = z - h(x) + H dx.
  template <class Measurement>
  static Update<Scalar, kErrors, Measurement::kDimension> correct_at(const Measurement& z, const State& x,
                                                                     const Vector<Scalar, kErrors>& dx,
                                                                     Symmetric<Scalar, kErrors>& covariance,
                                                                     Scalar gate) {
    constexpr std::size_t K = Measurement::kTouches.size();
    const Matrix<Scalar, Measurement::kDimension, static_cast<int>(K)> h = z.jacobian(x);
    Vector<Scalar, Measurement::kDimension> nu = z.residual(z.predict(x));
    for (std::size_t k = 0; k < K; ++k) nu += h.col(static_cast<int>(k)) * dx(Measurement::kTouches[k]);
    return filter::update<Scalar, kErrors, Measurement::kDimension, K>(covariance, h, Measurement::kTouches, nu,
                                                                       z.noise(), gate);
  }
};

}  // namespace tetap::filter
