// SPDX-License-Identifier: Apache-2.0
// Extended Kalman filter on any manifold state (Bar-Shalom, Li, Kirubarajan 2001, sec. 10.3; error-state form: Sola
// 2017, sec. 6).
#pragma once

#include "filter/state.hpp"
#include "filter/update.hpp"

namespace tetap::filter {

template <State State_>
class Ekf {
 public:
  using State = State_;
  using Scalar = typename State::Scalar;
  static constexpr int kErrors = State::kErrors;

  State x{};
  Symmetric<Scalar, kErrors> p{};

  /// x = f(x), P = F P F^T + Q.
  template <MotionModel<State> Motion>
  void predict(const Motion& motion) {
    const auto f = motion.jacobian(x);
    p = propagate(p, f, motion.noise(x));
    x = motion.predict(x);
  }

  /// Joint gate, then sequential scalar updates; a measurement that is rejected changes nothing.
  template <MeasurementModel<State> Measurement>
  [[nodiscard]] Innovation<Scalar, Measurement::kDimension> update(const Measurement& measurement, Scalar gate) {
    const auto result = filter::update<Scalar, kErrors, Measurement::kDimension, Measurement::kTouches.size()>(
        p, measurement.jacobian(x), Measurement::kTouches, measurement.residual(measurement.predict(x)),
        measurement.noise(), gate);
    if (result.innovation.verdict == Verdict::kAccepted) x = x.plus(result.dx);
    return result.innovation;
  }
};

}  // namespace tetap::filter
