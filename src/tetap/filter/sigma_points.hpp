// SPDX-License-Identifier: Apache-2.0
// Weights of the scaled unscented transform, and what a spread of symmetric pairs adds up to (Julier & Uhlmann 2004,
// sec. IV; van der Merwe 2004, ch. 3).
//
// Every mean and covariance is written in the differences d from the central point. Angles are never averaged and no
// large numbers cancel. With pairs d+, d- and their sum and difference, the central weights fall out:
//   mean - centre = shift = w sum(d+ + d-),
//   covariance = w sum(d+ d+^T + d- d-^T) + (beta - alpha^2) shift shift^T,      w = 1 / (2 (n + lambda)).
#pragma once

#include "tetap/base/math.hpp"
#include "tetap/base/math_double.hpp"
#include "tetap/filter/state.hpp"
#include "tetap/filter/unroll.hpp"

#include <array>
#include <cstddef>
#include <cstdint>

namespace tetap::filter {

/// The usual choice: points sqrt(n) standard deviations away, the fourth moment of a Gaussian.
struct UnitScaling {
  static constexpr float kAlpha = 1, kBeta = 2, kKappa = 0;
};

/// Scaling whose three numbers are chosen at run time.
struct RuntimeScaling {
  float kAlpha = 1, kBeta = 2, kKappa = 0;
};

enum class ScalingVerdict : std::uint8_t {
  kUsable,
  kAlphaNeedsSquareRoot,  ///< alpha below kLeastPlainAlpha: the plain form loses its covariance in float
  kBetaBelowAlpha2,       ///< beta < alpha^2: the weighted sum may be no covariance
  kSpreadNotPositive,     ///< alpha^2 (n + kappa) is not above zero, or not a number
};

/// Below, float keeps too few digits of the differences of the points: a sharp sensor takes P below zero in some steps.
inline constexpr float kLeastPlainAlpha = 0.1F;

template <class Scaling>
[[nodiscard]] constexpr ScalingVerdict judge_scaling(const Scaling& scaling, int n, bool square_root) {
  const float spread2 = scaling.kAlpha * scaling.kAlpha * (static_cast<float>(n) + scaling.kKappa);
  if (!(spread2 > 0.0F) || !(spread2 < 1e6F) || !(scaling.kAlpha > 0.0F)) return ScalingVerdict::kSpreadNotPositive;
  if (!(scaling.kBeta >= scaling.kAlpha * scaling.kAlpha)) return ScalingVerdict::kBetaBelowAlpha2;
  if (!square_root && !(scaling.kAlpha >= kLeastPlainAlpha)) return ScalingVerdict::kAlphaNeedsSquareRoot;
  return ScalingVerdict::kUsable;
}

template <class Scaling>
inline constexpr bool kConstantScaling = requires {
  std::bool_constant<(Scaling::kAlpha > 0.0F)>{};
};

/// Implements docs/explanation/unscented.md (1).
template <class Scalar>
struct SigmaWeights {
  Scalar spread;   ///< sqrt(n + lambda): distance of the points in standard deviations
  Scalar pair;     ///< weight of each outer point
  Scalar central;  ///< weight of shift shift^T

  template <class Scaling>
  constexpr SigmaWeights(const Scaling& scaling, int n)
      : spread(base::sqrt(spread2(scaling, n))),
        pair(Scalar(0.5F) / spread2(scaling, n)),
        central(static_cast<Scalar>(scaling.kBeta) - squared(static_cast<Scalar>(scaling.kAlpha))) {}

 private:
  static constexpr Scalar squared(Scalar v) { return v * v; }
  template <class Scaling>
  static constexpr Scalar spread2(const Scaling& scaling, int n) {
    return squared(static_cast<Scalar>(scaling.kAlpha)) *
           (static_cast<Scalar>(n) + static_cast<Scalar>(scaling.kKappa));
  }
};

/// Noise that enters the motion non-linearly: predict(x, w), and noise() are the variances of the components of w
/// (augmented form: van der Merwe 2004, ch. 3).
template <class M, class S>
concept AugmentedMotion = State<S> &&
    requires(const M& model, const S& x, const Vector<typename S::Scalar, M::kNoises>& w) {
  { model.predict(x, w) } -> std::same_as<S>;
  { model.noise() } -> std::same_as<Vector<typename S::Scalar, M::kNoises>>;
};

/// Noise that enters the measurement non-linearly: predict(x, v), and noise() are the variances of v.
template <class M, class S>
concept AugmentedMeasurement = State<S> &&
    requires(const M& model, const S& x, const Vector<typename S::Scalar, M::kNoises>& v,
             const Vector<typename S::Scalar, M::kDimension>& z_hat) {
  { model.predict(x, v) } -> std::same_as<Vector<typename S::Scalar, M::kDimension>>;
  { model.residual(z_hat) } -> std::same_as<Vector<typename S::Scalar, M::kDimension>>;
  { model.noise() } -> std::same_as<Vector<typename S::Scalar, M::kNoises>>;
};

/// First kFirst, then the other indices below N: the order in which a factor takes the states.
template <int N, std::size_t A>
[[nodiscard]] constexpr std::array<int, static_cast<std::size_t>(N)> pivot_order(const std::array<int, A>& first) {
  std::array<int, static_cast<std::size_t>(N)> order{};
  std::size_t next = 0;
  for (const int i : first) order[next++] = i;
  for (int i = 0; i < N; ++i) {
    bool taken = false;
    for (const int f : first) taken = taken || f == i;
    if (!taken) order[next++] = i;
  }
  return order;
}

template <int N>
[[nodiscard]] constexpr std::array<int, static_cast<std::size_t>(N)> all_indices() {
  return pivot_order<N>(std::array<int, 0>{});
}

/// Sigma points run over the error states a model names in kNonlinear; where it names none, over all that touch it.
template <class Model, int N>
[[nodiscard]] constexpr auto nonlinear_states() {
  if constexpr (requires { Model::kNonlinear; }) {
    return Model::kNonlinear;
  } else if constexpr (requires { Model::kTouches; }) {
    return Model::kTouches;
  } else {
    return all_indices<N>();
  }
}

/// Largest turn between a pair's points and the centre. Beyond half a turn a pair would wrap on itself, and an angle
/// that nobody knows would become sure without a measurement. At 1 rad sines are still nearly straight.
inline constexpr float kMostTurn = 1.0F;

/// How many times nearer than its distance a pair has to be: above 1 where a turn is more than kMostTurn. What the pair
/// shows is then taken as many times.
template <class Scalar>
[[nodiscard, gnu::always_inline]] constexpr Scalar nearer(Scalar turn) {
  const Scalar size = turn < Scalar{0} ? -turn : turn;
  return size > Scalar(kMostTurn) ? size * (Scalar{1} / Scalar(kMostTurn)) : Scalar{1};
}

/// Implements docs/explanation/unscented.md (8).
/// The same of a pair of states. A state names its angle in kAngle; a motion may turn it by turn(dx) besides.
template <class S, class Model, class Scalar, int N>
[[nodiscard, gnu::always_inline]] constexpr Scalar nearer(const Model& model, const Vector<Scalar, N>& dx) {
  Scalar times = 1;
  if constexpr (requires { S::kAngle; }) times = nearer(Scalar{dx(S::kAngle)});
  if constexpr (requires { model.turn(dx); }) {
    const Scalar by_motion = nearer(Scalar{model.turn(dx)});
    times = by_motion > times ? by_motion : times;
  }
  return times;
}

/// The same of a pair of noises: noise_turn(w).
template <class Model, class Scalar, int N>
[[nodiscard, gnu::always_inline]] constexpr Scalar nearer_noise(const Model& model, const Vector<Scalar, N>& w) {
  if constexpr (requires { model.noise_turn(w); })
    return nearer(Scalar{model.noise_turn(w)});
  else
    return Scalar{1};
}

}  // namespace tetap::filter
