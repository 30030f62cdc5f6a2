// SPDX-License-Identifier: Apache-2.0
// Square-root unscented Kalman filter (van der Merwe & Wan 2001; van der Merwe 2004, ch. 3), for additive and augmented
// noise. The root of P is rotated together from the differences of symmetric pairs. No down-date exists that could
// fail: in that form the central weight is beta - alpha^2 >= 0 (sigma_points.hpp).
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/filter/root_update.hpp"
#include "tetap/filter/sigma_points.hpp"
#include "tetap/filter/state.hpp"
#include "tetap/filter/triangular.hpp"
#include "tetap/filter/wrap.hpp"

#include <type_traits>

namespace tetap::filter {

template <State State_, class Scaling = UnitScaling>
class UkfSqrt {
 public:
  using State = State_;
  using Scalar = typename State::Scalar;
  static constexpr int kErrors = State::kErrors;

  State x{};
  Triangular<Scalar, kErrors> root;  ///< upper triangular R, P = R^T R

  static constexpr auto members(auto& self) { return base::members(self.x, self.root); }

  [[nodiscard]] Symmetric<Scalar, kErrors> covariance() const { return root.covariance(); }
  void set_covariance(const Symmetric<Scalar, kErrors>& p) { root = root_of(p); }

  /// Takes other weights, or refuses them and keeps those it has. Only with RuntimeScaling.
  [[nodiscard]] ScalingVerdict set_scaling(const Scaling& scaling) requires(!kConstantScaling<Scaling>) {
    const ScalingVerdict verdict = judge_scaling(scaling, kErrors, true);
    if (verdict == ScalingVerdict::kUsable) scaling_ = scaling;
    return verdict;
  }

  /// The state and its covariance through the motion, plus additive noise. False, and nothing has changed, when the
  /// result would be no number, or P not positive definite.
  template <MotionModel<State> Motion>
  requires(!AugmentedMotion<Motion, State>) bool predict(const Motion& motion) {
    return propagate<0>(
        motion, [&](const State& from, const auto&) { return motion.predict(from); }, {}, motion.noise(x));
  }
  template <AugmentedMotion<State> Motion>
  bool predict(const Motion& motion) {
    return propagate<Motion::kNoises>(motion, [&](const State& from, const auto& w) { return motion.predict(from, w); },
                                      motion.noise(), {});
  }

  /// Joint gate, then the correction; a measurement that is rejected changes nothing.
  template <MeasurementModel<State> Measurement>
  requires(!AugmentedMeasurement<Measurement, State>)
      [[nodiscard]] Innovation<Scalar, Measurement::kDimension> update(const Measurement& z, Scalar gate) {
    return fuse<Measurement, 0>(
        z, [&](const State& at, const auto&) { return observed(z, at); }, {}, z.noise(), gate);
  }
  template <AugmentedMeasurement<State> Measurement>
  [[nodiscard]] Innovation<Scalar, Measurement::kDimension> update(const Measurement& z, Scalar gate) {
    return fuse<Measurement, Measurement::kNoises>(
        z, [&](const State& at, const auto& v) { return z.predict(at, v); }, z.noise(),
        Vector<Scalar, Measurement::kDimension>::Zero(), gate);
  }

 private:
  template <int kNoises>
  static constexpr void require_scaling() {
    if constexpr (kConstantScaling<Scaling>)
      static_assert(judge_scaling(Scaling{}, kErrors + kNoises, true) == ScalingVerdict::kUsable,
                    "alpha^2 (n + kappa) > 0 and beta >= alpha^2");
  }
  [[nodiscard]] Vector<Scalar, kErrors> direction(int j) const {
    Vector<Scalar, kErrors> d;
#pragma GCC unroll 16
    for (int c = 0; c < kErrors; ++c) d(c) = c < j ? Scalar{0} : root(j, c);
    return d;
  }

  template <int kNoises, class Motion, class Function>
  bool propagate(const Motion& motion, const Function& f, const Vector<Scalar, kNoises>& noise,
                 const Symmetric<Scalar, kErrors>& q) {
    require_scaling<kNoises>();
    const SigmaWeights<Scalar> w(scaling_, kErrors + kNoises);
    const Scalar half = base::sqrt(Scalar(0.5F) * w.pair);
    const Vector<Scalar, kNoises> still = Vector<Scalar, kNoises>::Zero();
    const State centre = f(x, still);
    Vector<Scalar, kErrors> sum = Vector<Scalar, kErrors>::Zero();
    Triangular<Scalar, kErrors> next = root_of(q);
    const auto add = [&](Vector<Scalar, kErrors> up, Vector<Scalar, kErrors> down, Scalar times) {
      if (times > Scalar{1}) up *= times, down *= times;
      sum += up + down;
      next.absorb(half * (up - down));
      next.absorb(half * (up + down));
    };
    for (int j = 0; j < kErrors; ++j) {
      Vector<Scalar, kErrors> dx = w.spread * direction(j);
      const Scalar times = nearer<State>(motion, dx);
      if (times > Scalar{1}) dx /= times;
      add(f(x.plus(dx), still).minus(centre), f(x.plus(-dx), still).minus(centre), times);
    }
    for (int k = 0; k < kNoises; ++k) {
      Vector<Scalar, kNoises> far = still;
      far(k) = w.spread * base::sqrt(noise(k));
      const Scalar times = nearer_noise(motion, far);
      if (times > Scalar{1}) far /= times;
      add(f(x, far).minus(centre), f(x, -far).minus(centre), times);
    }
    const Vector<Scalar, kErrors> shift = w.pair * sum;
    next.absorb(base::sqrt(w.central) * shift);
    const State moved = centre.plus(shift);
    if (!q.no_variance_below_zero() || !next.regular() || !moved.finite()) return false;
    x = moved;
    root = next;
    return true;
  }

  /// Implements docs/explanation/unscented.md (7).
  template <class Measurement, int kNoises, class Function>
  Innovation<Scalar, Measurement::kDimension> fuse(const Measurement& z, const Function& h,
                                                   const Vector<Scalar, kNoises>& noise,
                                                   const Vector<Scalar, Measurement::kDimension>& additive,
                                                   Scalar gate) {
    require_scaling<kNoises>();
    constexpr int M = Measurement::kDimension;
    const SigmaWeights<Scalar> w(scaling_, kErrors + kNoises);
    const Scalar half = base::sqrt(Scalar(0.5F) * w.pair);
    const Vector<Scalar, kNoises> still = Vector<Scalar, kNoises>::Zero();
    const auto centre = h(x, still);
    Vector<Scalar, M> sum = Vector<Scalar, M>::Zero();
    Triangular<Scalar, M> e;  // root of what is in S beside the slopes
    for (int m = 0; m < M; ++m) e(m, m) = base::sqrt(additive(m));
    Matrix<Scalar, kErrors, M> slope;
    const auto pair = [&](const State& up, const State& down, const auto& v, const auto& minus_v, Scalar times) {
      Vector<Scalar, M> above = difference_of(z, h(up, v), centre);
      Vector<Scalar, M> below = difference_of(z, h(down, minus_v), centre);
      if (times > Scalar{1}) above *= times, below *= times;
      sum += above + below;
      e.absorb(half * (above + below));
      return Vector<Scalar, M>(above - below);
    };
    for (int j = 0; j < kErrors; ++j) {
      Vector<Scalar, kErrors> dx = w.spread * direction(j);
      const Scalar times = nearer<State>(z, dx);
      if (times > Scalar{1}) dx /= times;
      slope.row(j) = (Scalar(0.5F) / w.spread) * pair(x.plus(dx), x.plus(-dx), still, still, times).transpose();
    }
    for (int k = 0; k < kNoises; ++k) {
      Vector<Scalar, kNoises> far = still;
      far(k) = w.spread * base::sqrt(noise(k));
      e.absorb(half * pair(x, x, far, -far, Scalar{1}));
    }
    const Vector<Scalar, M> shift = w.pair * sum;
    e.absorb(base::sqrt(w.central) * shift);
    const auto result = root_update<Scalar, kErrors, M>(root, e, slope, z.residual(value_of(z, centre) + shift), gate);
    if (result.innovation.verdict == Verdict::kAccepted) x = x.plus(result.dx);
    return result.innovation;
  }

  [[no_unique_address]] Scaling scaling_{};
};

}  // namespace tetap::filter
