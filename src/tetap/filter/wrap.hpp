// SPDX-License-Identifier: Apache-2.0
// Differences of measurements whose components may be angles: the short way round, in float or double.
#pragma once

#include "tetap/base/math.hpp"
#include "tetap/filter/symmetric.hpp"

#include <cstdint>
#include <type_traits>

namespace tetap::filter {

/// The angle less whole turns. Double is for the host: exact to its rounding within 2^20 rad.
template <class Scalar>
[[nodiscard]] constexpr Scalar wrapped(Scalar angle_rad) {
  if constexpr (std::is_same_v<Scalar, float>) {
    return base::wrap_angle(angle_rad);
  } else {
    constexpr double kPi = 0x1.921fb54442d18p+1, kPiLow = 0x1.1a62633145c07p-53;
    if (angle_rad >= -kPi && angle_rad <= kPi) return angle_rad;
    constexpr double kRound = 0x1.8p+52;
    const double turns = (angle_rad * (0.5 / kPi) + kRound) - kRound;
    return (angle_rad - turns * 2.0 * kPi) - turns * 2.0 * kPiLow;
  }
}

/// The angle from one direction to another, from their cross and dot products. Its error is 2e-7 of |angle| for the
/// small angles between sigma points. atan2 would cost five times as much there.
template <class Scalar>
[[nodiscard]] constexpr Scalar angle_between(Scalar cross, Scalar dot) {
  const Scalar reach = Scalar(0.25F) * dot;
  if (std::is_same_v<Scalar, double> || !(cross < reach && cross > -reach)) return base::atan2(cross, dot);
  const Scalar q = cross / dot;
  const Scalar z = q * q;  // atan q = q - q^3/3 + q^5/5 - ...; the next term is below 2^-25
  return q - q * z * (Scalar(1.0F / 3) - z * (Scalar(1.0F / 5) - z * (Scalar(1.0F / 7) - z * Scalar(1.0F / 9))));
}

/// a - b, component by component; those in Model::kAngles are wrapped.
template <class Model, class Scalar, int M>
[[nodiscard, gnu::always_inline]] inline Vector<Scalar, M> measurement_difference(const Vector<Scalar, M>& a,
                                                                                  const Vector<Scalar, M>& b) {
  Vector<Scalar, M> d = a - b;
  if constexpr (requires { Model::kAngles; })
    for (const int i : Model::kAngles) d(i) = wrapped(d(i));
  return d;
}

/// Observation of a state: the quantities that z_hat and differences share, where the model has observe(); else z_hat.
template <class Model, class State>
[[nodiscard, gnu::always_inline]] inline auto observed(const Model& model, const State& x) {
  if constexpr (requires { model.observe(x); }) {
    return model.observe(x);
  } else {
    return model.predict(x);
  }
}
template <class Model, class Seen>
[[nodiscard, gnu::always_inline]] inline auto value_of(const Model& model, const Seen& seen) {
  if constexpr (requires { model.value(seen); }) {
    return model.value(seen);
  } else {
    return seen;
  }
}
/// z_hat of one observation less that of another, the short way round.
template <class Model, class Seen>
[[nodiscard, gnu::always_inline]] inline auto difference_of(const Model& model, const Seen& at, const Seen& from) {
  if constexpr (requires { model.difference(at, from); }) {
    return model.difference(at, from);
  } else {
    return measurement_difference<Model>(at, from);
  }
}

}  // namespace tetap::filter
