// SPDX-License-Identifier: Apache-2.0
// Unscented Kalman filter (Julier & Uhlmann 2004; van der Merwe 2004, ch. 3; Thrun, Burgard, Fox 2005, table 3.4),
// for additive and augmented noise, on any manifold state. No Jacobian is needed.
//
// Sigma points are drawn only over states that enter a model non-linearly. The Cholesky factor takes those first, so
// its other columns move the linear states alone. A symmetric pair of such points adds exactly that column's
// covariance. The result is the full transform's (Briers, Maskell, Wright 2003, for models that are linear in part).
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/filter/condition.hpp"
#include "tetap/filter/correction.hpp"
#include "tetap/filter/sigma_points.hpp"
#include "tetap/filter/state.hpp"
#include "tetap/filter/wrap.hpp"

namespace tetap::filter {

/// The columns of a Cholesky factor of P that belong to some states, and the covariance of the others given those.
template <class Scalar, int N, std::size_t A>
struct PartialFactor {
  Matrix<Scalar, N, static_cast<int>(A)> l;
  Symmetric<Scalar, N> rest;  ///< conditional covariance; entries of the factored states mean nothing
  bool positive = true;
};

/// Implements docs/explanation/unscented.md (4).
template <std::size_t A, class Scalar, int N>
[[nodiscard, gnu::always_inline]] inline PartialFactor<Scalar, N, A> partial_factor(
    const Symmetric<Scalar, N>& p, const std::array<int, static_cast<std::size_t>(N)>& order) {
  PartialFactor<Scalar, N, A> out{.l = {}, .rest = p};
  unroll<0, static_cast<int>(A)>([&](auto j) __attribute__((always_inline)) {
    const Scalar pivot = out.rest(order[j], order[j]);
    const bool any = pivot > Scalar{0};  // a variance of zero has no direction to draw points along
    out.positive = out.positive && pivot >= Scalar{0};
    const Scalar root = any ? base::sqrt(pivot) : Scalar{0};
    const Scalar inverse = any ? Scalar{1} / root : Scalar{0};
    unroll<0, j>([&](auto i) __attribute__((always_inline)) { out.l(order[i], int{j}) = Scalar{0}; });
    out.l(order[j], int{j}) = root;
    unroll<j + 1, N>([&](auto i) __attribute__((always_inline)) {
      out.l(order[i], int{j}) = out.rest(order[i], order[j]) * inverse;
      unroll<j + 1, i + 1>([&](auto k) __attribute__((always_inline)) {
        out.rest(order[k], order[i]) -= out.l(order[k], int{j}) * out.l(order[i], int{j});
      });
    });
  });
  return out;
}

/// Sum and covariance of what symmetric pairs of points became, in differences from the central point.
template <class Scalar, int N>
struct PairSum {
  Vector<Scalar, N> sum;
  Symmetric<Scalar, N> spread;  ///< sum of d+ d+^T + d- d-^T, twice

  /// Implements docs/explanation/unscented.md (2).
  /// Takes one pair; gives d+ - d-, the slope along the pair. The first pair begins the sums.
  template <bool kFirst>
  [[gnu::always_inline]] Vector<Scalar, N> add(std::bool_constant<kFirst>, const Vector<Scalar, N>& up,
                                               const Vector<Scalar, N>& down) {
    const Vector<Scalar, N> s = up + down;
    Vector<Scalar, N> t = up - down;
    sum = kFirst ? s : Vector<Scalar, N>(sum + s);
    unroll<0, N>([&](auto c) __attribute__((always_inline)) {
      unroll<0, c + 1>([&](auto r) __attribute__((always_inline)) {
        const Scalar square = t(int{r}) * t(int{c}) + s(int{r}) * s(int{c});
        spread(r, c) = kFirst ? square : spread(r, c) + square;
      });
    });
    return t;
  }
  /// Implements docs/explanation/unscented.md (3).
  [[nodiscard, gnu::always_inline]] Symmetric<Scalar, N> covariance(const Vector<Scalar, N>& shift,
                                                                    const SigmaWeights<Scalar>& w) const {
    Symmetric<Scalar, N> p;
    unroll<0, N>([&](auto c) __attribute__((always_inline)) {
      unroll<0, c + 1>([&](auto r) __attribute__((always_inline)) {
        p(r, c) = (Scalar(0.5F) * w.pair) * spread(r, c) + w.central * (shift(int{r}) * shift(int{c}));
      });
    });
    return p;
  }
};

template <State State_, class Scaling = UnitScaling>
class Ukf {
 public:
  using State = State_;
  using Scalar = typename State::Scalar;
  static constexpr int kErrors = State::kErrors;

  State x{};
  Symmetric<Scalar, kErrors> p{};

  static constexpr auto members(auto& self) { return base::members(self.x, self.p); }

  /// Takes other weights, or refuses them and keeps those it has. Only with RuntimeScaling.
  [[nodiscard]] ScalingVerdict set_scaling(const Scaling& scaling) requires(!kConstantScaling<Scaling>) {
    const ScalingVerdict verdict = judge_scaling(scaling, kErrors, false);
    if (verdict == ScalingVerdict::kUsable) scaling_ = scaling;
    return verdict;
  }

  /// The state and its covariance through the motion, plus additive noise. False, and nothing has changed, when the
  /// result would be no number, or P beyond all sizes.
  template <MotionModel<State> Motion>
  requires(!AugmentedMotion<Motion, State>) bool predict(const Motion& motion) {
    const Symmetric<Scalar, kErrors> q = motion.noise(x);
    return propagate<Motion, 0>(
        motion, [&](const State& from, const auto&) { return motion.predict(from); }, {}, q);
  }
  template <AugmentedMotion<State> Motion>
  bool predict(const Motion& motion) {
    return propagate<Motion, Motion::kNoises>(
        motion, [&](const State& from, const auto& w) { return motion.predict(from, w); }, motion.noise(), {});
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
    if constexpr (kConstantScaling<Scaling>) {
      constexpr ScalingVerdict kVerdict = judge_scaling(Scaling{}, kErrors + kNoises, false);
      static_assert(kVerdict != ScalingVerdict::kAlphaNeedsSquareRoot, "alpha < 0.1 needs UkfSqrt");
      static_assert(kVerdict != ScalingVerdict::kBetaBelowAlpha2, "beta < alpha^2 gives no covariance");
      static_assert(kVerdict == ScalingVerdict::kUsable, "alpha^2 (n + kappa) has to be above zero");
    }
  }

  /// Implements docs/explanation/unscented.md (5).
  template <class Motion, int kNoises, class Function>
  [[gnu::always_inline]] bool propagate(const Motion& motion, const Function& f, const Vector<Scalar, kNoises>& noise,
                                        const Symmetric<Scalar, kErrors>& q) {
    require_scaling<kNoises>();
    const SigmaWeights<Scalar> w(scaling_, kErrors + kNoises);
    constexpr auto kStates = nonlinear_states<Motion, kErrors>();
    constexpr auto kOrder = pivot_order<kErrors>(kStates);
    constexpr int kPoints = static_cast<int>(kStates.size());
    const auto factor = partial_factor<kStates.size()>(p, kOrder);
    Vector<Scalar, kNoises> still = Vector<Scalar, kNoises>::Zero();
    const State centre = f(x, still);
    PairSum<Scalar, kErrors> pairs;
    unroll<0, kPoints>([&](auto j) __attribute__((always_inline)) {
      Vector<Scalar, kErrors> dx = w.spread * factor.l.col(j);
      const Scalar times = nearer<State>(motion, dx);
      if (times > Scalar{1}) dx /= times;
      Vector<Scalar, kErrors> up = f(x.plus(dx), still).minus(centre), down = f(x.plus(-dx), still).minus(centre);
      if (times > Scalar{1}) up *= times, down *= times;
      pairs.add(std::bool_constant<j == 0>{}, up, down);
    });
    unroll<0, kNoises>([&](auto k) __attribute__((always_inline)) {
      Vector<Scalar, kNoises> far = still;
      far(int{k}) = w.spread * base::sqrt(noise(int{k}));
      const Scalar times = nearer_noise(motion, far);
      if (times > Scalar{1}) far /= times;
      Vector<Scalar, kErrors> up = f(x, far).minus(centre), down = f(x, -far).minus(centre);
      if (times > Scalar{1}) up *= times, down *= times;
      pairs.add(std::false_type{}, up, down);
    });
    const Vector<Scalar, kErrors> shift = w.pair * pairs.sum;
    Symmetric<Scalar, kErrors> next = pairs.covariance(shift, w);
    unroll<0, kErrors>([&](auto c) __attribute__((always_inline)) {
      unroll<0, c + 1>([&](auto r) __attribute__((always_inline)) { next(r, c) += q(r, c); });
    });
    unroll<kPoints, kErrors>([&](auto c) __attribute__((always_inline)) {
      unroll<kPoints, c + 1>([&](auto r) __attribute__((always_inline)) {
        next(kOrder[r], kOrder[c]) += factor.rest(kOrder[r], kOrder[c]);
      });
    });
    const State moved = centre.plus(shift);
    if (!factor.positive || !q.no_variance_below_zero() || !next.bounded() || !moved.finite()) return false;
    x = moved;
    p = next;
    if (!well_conditioned(p)) restore(p);
    return true;
  }

  /// Implements docs/explanation/unscented.md (6).
  template <class Measurement, int kNoises, class Function>
  [[gnu::always_inline]] Innovation<Scalar, Measurement::kDimension> fuse(
      const Measurement& z, const Function& h, const Vector<Scalar, kNoises>& noise,
      const Vector<Scalar, Measurement::kDimension>& additive, Scalar gate) {
    require_scaling<kNoises>();
    constexpr int M = Measurement::kDimension;
    const SigmaWeights<Scalar> w(scaling_, kErrors + kNoises);
    constexpr auto kStates = nonlinear_states<Measurement, kErrors>();
    constexpr auto kOrder = pivot_order<kErrors>(kStates);
    constexpr int kPoints = static_cast<int>(kStates.size());
    const auto factor = partial_factor<kStates.size()>(p, kOrder);
    Vector<Scalar, kNoises> still = Vector<Scalar, kNoises>::Zero();
    const auto centre = h(x, still);
    const auto difference = [&](const auto& at) __attribute__((always_inline)) { return difference_of(z, at, centre); };
    PairSum<Scalar, M> pairs;
    Matrix<Scalar, kErrors, M> cross;
    unroll<0, kPoints>([&](auto j) __attribute__((always_inline)) {
      const Vector<Scalar, kErrors> dx = w.spread * factor.l.col(j);
      const Scalar times = nearer<State>(z, dx);
      const Vector<Scalar, kErrors> near = times > Scalar{1} ? Vector<Scalar, kErrors>(dx / times) : dx;
      Vector<Scalar, M> up = difference(h(x.plus(near), still)), down = difference(h(x.plus(-near), still));
      if (times > Scalar{1}) up *= times, down *= times;
      const Vector<Scalar, M> slope = pairs.add(std::bool_constant<j == 0>{}, up, down);
      unroll<0, M>([&](auto m) __attribute__((always_inline)) {
        unroll<j, kErrors>([&](auto n) __attribute__((always_inline)) {
          const Scalar product = (w.pair * slope(int{m})) * dx(kOrder[n]);
          cross(kOrder[n], int{m}) = j == 0 ? product : cross(kOrder[n], int{m}) + product;
        });
      });
    });
    unroll<0, kNoises>([&](auto k) __attribute__((always_inline)) {
      const Scalar far = w.spread * base::sqrt(noise(int{k}));
      Vector<Scalar, kNoises> up = still, down = still;
      up(int{k}) = far;
      down(int{k}) = -far;
      pairs.add(std::false_type{}, difference(h(x, up)), difference(h(x, down)));
    });
    const Vector<Scalar, M> shift = w.pair * pairs.sum;
    Symmetric<Scalar, M> s = pairs.covariance(shift, w);
    add_linear(z, factor.rest, cross, s);
    unroll<0, M>([&](auto m) __attribute__((always_inline)) { s(m, m) += additive(int{m}); });
    const auto result = correct<Scalar, kErrors, M>(p, cross, s, z.residual(value_of(z, centre) + shift), gate);
    if (result.innovation.verdict != Verdict::kAccepted) return result.innovation;
    x = x.plus(result.dx);
    if (!well_conditioned(p)) restore(p);
    return result.innovation;
  }

  /// Adds to cov(x, z) and to S the conditional covariance of the states in kLinear; slopes() are their columns of H.
  template <class Measurement, int M>
  [[gnu::always_inline]] static void add_linear(const Measurement& z, const Symmetric<Scalar, kErrors>& rest,
                                                Matrix<Scalar, kErrors, M>& cross, Symmetric<Scalar, M>& s) {
    if constexpr (requires { Measurement::kLinear; }) {
      constexpr auto kStates = nonlinear_states<Measurement, kErrors>();
      constexpr auto kOrder = pivot_order<kErrors>(kStates);
      constexpr int kCount = static_cast<int>(Measurement::kLinear.size());
      const Matrix<Scalar, M, kCount> slopes = z.slopes();
      Matrix<Scalar, kErrors, M> more = Matrix<Scalar, kErrors, M>::Zero();  // rest H^T
      unroll<static_cast<int>(kStates.size()), kErrors>([&](auto n) __attribute__((always_inline)) {
        unroll<0, M>([&](auto m) __attribute__((always_inline)) {
          Scalar sum = 0;
          unroll<0, kCount>([&](auto k) __attribute__((always_inline)) {
            sum += rest(kOrder[n], Measurement::kLinear[k]) * slopes(int{m}, int{k});
          });
          more(kOrder[n], int{m}) = sum;
          cross(kOrder[n], int{m}) += sum;
        });
      });
      unroll<0, M>([&](auto c) __attribute__((always_inline)) {
        unroll<0, c + 1>([&](auto r) __attribute__((always_inline)) {
          unroll<0, kCount>([&](auto k) __attribute__((always_inline)) {
            s(r, c) += slopes(int{r}, int{k}) * more(Measurement::kLinear[k], int{c});
          });
        });
      });
    }
  }

  [[no_unique_address]] Scaling scaling_{};
};

}  // namespace tetap::filter
