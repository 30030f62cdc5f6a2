// SPDX-License-Identifier: Apache-2.0
// Demands of a filter on a state and on its models. A state lives on a manifold: x.plus(dx) moves it by an error
// vector, x.minus(other) is the error vector that leads from other to x. Dense vectors are the trivial case.
#pragma once

#include "tetap/filter/symmetric.hpp"

#include <array>
#include <concepts>

namespace tetap::filter {

template <class S>
concept State = requires(const S& x, const Vector<typename S::Scalar, S::kErrors>& dx) {
  { x.plus(dx) } -> std::same_as<S>;
  { x.finite() } -> std::same_as<bool>;
  { x.minus(x) } -> std::same_as<Vector<typename S::Scalar, S::kErrors>>;
};

/// Result of a motion model that is asked for everything at once (step()), as linearised() of a measurement model. It
/// is for models whose parts share work, trigonometry mostly. The filter asks for the whole where a model has it.
template <class S>
struct Step {
  S x;
  Matrix<typename S::Scalar, S::kErrors, S::kErrors> f;
  Symmetric<typename S::Scalar, S::kErrors> q;
};
/// The same with types for F and Q that hold their zeros and ones (structure.hpp): result of sparse_step().
template <class S, class F, class Q = Symmetric<typename S::Scalar, S::kErrors>>
struct SparseStep {
  S x;
  F f;
  Q q;
};
template <class Scalar, int M, int K>
struct Linearised {
  Vector<Scalar, M> z_hat;
  Matrix<Scalar, M, K> h;
};

/// x+ = predict(x), with the process noise Q added over the step.
template <class M, class S>
concept MotionModel = State<S> && requires(const M& model, const S& x) {
  { model.predict(x) } -> std::same_as<S>;
  { model.noise(x) } -> std::same_as<Symmetric<typename S::Scalar, S::kErrors>>;
};

/// A motion model with F = d predict / d error state.
template <class M, class S>
concept LinearisedMotion = MotionModel<M, S> && requires(const M& model, const S& x) {
  { model.jacobian(x) } -> std::same_as<Matrix<typename S::Scalar, S::kErrors, S::kErrors>>;
};

/// A model holds one measurement z. kTouches names the error states that enter it, so that a sparse update costs what
/// it must. residual() is z minus z_hat, wrapped where a component is an angle; kAngles, where a model has it, names
/// those components. noise() are variances of independent components.
template <class M, class S>
concept MeasurementModel = State<S> &&
    requires(const M& model, const S& x, const Vector<typename S::Scalar, M::kDimension>& z_hat) {
  { model.predict(x) } -> std::same_as<Vector<typename S::Scalar, M::kDimension>>;
  { model.residual(z_hat) } -> std::same_as<Vector<typename S::Scalar, M::kDimension>>;
  { model.noise() } -> std::same_as<Vector<typename S::Scalar, M::kDimension>>;
  M::kTouches.size();
};

/// A measurement model with the Jacobian of its prediction: column k belongs to error state kTouches[k].
template <class M, class S>
concept LinearisedModel = MeasurementModel<M, S> && requires(const M& model, const S& x) {
  {
    model.jacobian(x)
    } -> std::same_as<Matrix<typename S::Scalar, M::kDimension, static_cast<int>(M::kTouches.size())>>;
};

/// A state that is just N numbers.
template <class Scalar_, int N>
struct VectorState {
  using Scalar = Scalar_;
  static constexpr int kErrors = N;
  Vector<Scalar, N> value = Vector<Scalar, N>::Zero();

  [[nodiscard]] VectorState plus(const Vector<Scalar, N>& dx) const { return {value + dx}; }
  [[nodiscard]] Vector<Scalar, N> minus(const VectorState& other) const { return value - other.value; }
  [[nodiscard]] bool finite() const {
    Scalar nothing = 0;
#pragma GCC unroll 16
    for (int i = 0; i < N; ++i) nothing += value(i) * Scalar{0};  // NaN of NaN and infinities
    return nothing >= Scalar{0};
  }
};

}  // namespace tetap::filter
