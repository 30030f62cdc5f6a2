// SPDX-License-Identifier: Apache-2.0
// Extended Kalman filter on any manifold state (Bar-Shalom, Li, Kirubarajan 2001, sec. 10.3; error-state form: Sola
// 2017, sec. 6).
#pragma once

#include "tetap/filter/condition.hpp"
#include "tetap/filter/state.hpp"
#include "tetap/filter/structure.hpp"
#include "tetap/filter/update.hpp"

namespace tetap::filter {

template <State State_>
class Ekf {
 public:
  using State = State_;
  using Scalar = typename State::Scalar;
  static constexpr int kErrors = State::kErrors;

  State x{};
  Symmetric<Scalar, kErrors> p{};

  /// x = f(x), P = F P F^T + Q: docs/explanation/equations.md (1). False, and nothing has changed, when either would be
  /// no number, or P beyond all sizes.
  template <LinearisedMotion<State> Motion>
  bool predict(const Motion& motion) {
    if constexpr (requires { motion.sparse_step(x); }) {
      const auto step = motion.sparse_step(x);
      Symmetric<Scalar, kErrors> covariance = turned(p, step.f);
      add_noise(covariance, step.q);
      return adopt(step.x, covariance, dense(step.q));
    } else if constexpr (requires { motion.step(x); }) {
      const Step<State> step = motion.step(x);
      return adopt(step.x, propagate(p, step.f, step.q), step.q);
    } else {
      const Symmetric<Scalar, kErrors> q = motion.noise(x);
      return adopt(motion.predict(x), propagate(p, motion.jacobian(x), q), q);
    }
  }

  /// Joint gate, then sequential scalar updates; a measurement that is rejected changes nothing.
  template <LinearisedModel<State> Measurement>
  [[nodiscard]] Innovation<Scalar, Measurement::kDimension> update(const Measurement& measurement, Scalar gate) {
    constexpr int kColumns = static_cast<int>(Measurement::kTouches.size());
    Linearised<Scalar, Measurement::kDimension, kColumns> at;
    if constexpr (requires { measurement.linearised(x); }) {
      at = measurement.linearised(x);
    } else {
      at = {.z_hat = measurement.predict(x), .h = measurement.jacobian(x)};
    }
    const auto result = filter::update<Scalar, kErrors, Measurement::kDimension, Measurement::kTouches.size()>(
        p, at.h, Measurement::kTouches, measurement.residual(at.z_hat), measurement.noise(), gate);
    if (result.innovation.verdict != Verdict::kAccepted) return result.innovation;
    x = x.plus(result.dx);
    if (!well_conditioned(p)) restore(p);
    return result.innovation;
  }

 private:
  bool adopt(const State& next, const Symmetric<Scalar, kErrors>& covariance, const Symmetric<Scalar, kErrors>& q) {
    if (!q.no_variance_below_zero() || !covariance.bounded() || !next.finite()) return false;
    p = covariance;
    x = next;
    if (!well_conditioned(p)) restore(p);
    return true;
  }
};

}  // namespace tetap::filter
