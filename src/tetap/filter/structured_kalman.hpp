// SPDX-License-Identifier: Apache-2.0
// Kalman filter, linear or extended, that pays for what a model's types leave open (structure.hpp). It pays too for
// what its own type asks: a gate, a record, guards. Equations are as in correction.hpp (Bierman 1977, ch. V); results
// are those of Ekf.
#pragma once

#include "tetap/filter/condition.hpp"
#include "tetap/filter/correction.hpp"
#include "tetap/filter/state.hpp"
#include "tetap/filter/structure.hpp"

#include <type_traits>

namespace tetap::filter {

enum class Guard : std::uint8_t {
  kNone,         ///< inputs are numbers, and P stays in the range of float by the design of the application
  kVariances,    ///< variances above zero and bounded after a prediction, pivots of S above zero, a floor below P
  kConditioned,  ///< the same, and P conditioned: after every prediction, and after an update by a sharp measurement
};

template <State State_, Guard kGuard = Guard::kVariances>
class StructuredKalman {
 public:
  using State = State_;
  using Scalar = typename State::Scalar;
  static constexpr int kErrors = State::kErrors;

  State x{};
  Symmetric<Scalar, kErrors> p{};

  /// x = f(x), P = F P F^T + Q. A model has step(x), or predict, jacobian and noise. False, and nothing has changed,
  /// when a guard refuses the result; always true without guards.
  template <class Motion>
  [[gnu::always_inline]] bool predict(const Motion& motion) {
    if constexpr (requires { motion.sparse_step(x); }) {
      const auto step = motion.sparse_step(x);
      return adopt(step.x, step.f, step.q);
    } else if constexpr (requires { motion.step(x); }) {
      const auto step = motion.step(x);
      return adopt(step.x, step.f, step.q);
    } else {
      return adopt(motion.predict(x), motion.jacobian(x), motion.noise(x));
    }
  }

  /// With a number for the gate, the joint gate comes first and a measurement that is rejected changes nothing. With
  /// NoGate{} no NIS is computed and every measurement is accepted. Parts of the record that nobody reads cost nothing.
  template <MeasurementModel<State> Measurement, class Gate>
  [[gnu::always_inline]] Innovation<Scalar, Measurement::kDimension> update(const Measurement& z, const Gate& gate) {
    constexpr int M = Measurement::kDimension;
    Innovation<Scalar, M> record;
    Matrix<Scalar, kErrors, M> cross;  // P H^T
    const bool sharp = linearise(z, record, cross);
    const Decorrelated<Scalar, kErrors, M> by = decorrelate<kGuard == Guard::kConditioned>(cross, record.s, record.nu);
    if (kGuard != Guard::kNone && !by.positive) {
      record.verdict = record.s.bounded() ? Verdict::kSingular : Verdict::kNotFinite;
      return record;
    }
    if constexpr (!std::is_same_v<Gate, NoGate>) {
      record.gate = static_cast<Scalar>(gate);
      unroll<0, M>([&](auto j) __attribute__((always_inline)) {
        record.nis += by.y(int{j}) * (by.y(int{j}) * by.inverse(int{j}));
      });
      if (kGuard != Guard::kNone && !(record.nis < Scalar(1e30F))) return record;
      if (!(record.nis <= record.gate)) {
        record.verdict = Verdict::kRejected;
        return record;
      }
    }
    record.verdict = Verdict::kAccepted;
    x = x.plus(state_correction(by));
    subtract_gain<kGuard != Guard::kNone>(p, by);
    if constexpr (kGuard == Guard::kConditioned)
      if (sharp && !well_conditioned(p)) restore(p);
    return record;
  }

 private:
  template <class F, class Q>
  [[gnu::always_inline]] bool adopt(const State& moved, const F& f, const Q& q) {
    Symmetric<Scalar, kErrors> next = turned(p, f);
    add_noise(next, q);
    if constexpr (kGuard == Guard::kConditioned) {
      // Positive pivots and variances with a bounded sum bound every entry: nothing else can be wrong with P.
      Scalar sum = next(0, 0);
      unroll<1, kErrors>([&](auto i) __attribute__((always_inline)) { sum += next(i, i); });
      if (!surely_well_conditioned(next) || !(sum < Scalar(1e30F)) || !moved.finite())
        return adopt_restored(moved, next);
    } else if constexpr (kGuard != Guard::kNone) {
      // With |p(i, j)| <= (p(i, i) + p(j, j)) / 2 the variances bound all entries; NaN is neither above nor below.
      Scalar sum = next(0, 0), least = next(0, 0);
      unroll<1, kErrors>([&](auto i) __attribute__((always_inline)) {
        sum += next(i, i);
        least = next(i, i) < least ? next(i, i) : least;
      });
      if (!(least > Scalar{0}) || !(sum < Scalar(1e30F)) || !moved.finite()) return false;
    }
    p = next;
    x = moved;
    return true;
  }
  /// The same for a P that has to be looked at closely: it is restored. A P with a negative variance, or an entry that
  /// is no number, is refused.
  [[gnu::cold, gnu::noinline]] bool adopt_restored(const State& moved, const Symmetric<Scalar, kErrors>& next) {
    if (!next.no_variance_below_zero() || !next.bounded() || !moved.finite()) return false;
    p = next;
    x = moved;
    if (!well_conditioned(p)) restore(p);
    return true;
  }

  /// Below this share of S the noise of a component takes away more digits of P than float can spare.
  static constexpr Scalar kSharp = Scalar(1e-3F);

  /// nu, S = H P H^T + R and P H^T. True: some component is sharp.
  template <class Measurement, int M>
  [[gnu::always_inline]] bool linearise(const Measurement& z, Innovation<Scalar, M>& record,
                                        Matrix<Scalar, kErrors, M>& cross) const {
    constexpr int K = static_cast<int>(Measurement::kTouches.size());
    constexpr auto kState = [](int k) { return Measurement::kTouches[static_cast<std::size_t>(k)]; };
    const Vector<Scalar, M> noise = z.noise();
    if constexpr (requires { Measurement::kSelects; }) {  // H picks states: its products are entries of P
      record.nu = z.residual(z.predict(x));
      unroll<0, M>([&](auto m) __attribute__((always_inline)) {
        unroll<0, kErrors>([&](auto n) __attribute__((always_inline)) { cross(int{n}, int{m}) = p(n, kState(m)); });
        unroll<0, m + 1>([&](auto r) __attribute__((always_inline)) { record.s(r, m) = p(kState(r), kState(m)); });
        record.s(m, m) += noise(int{m});
      });
    } else {
      const Linearised<Scalar, M, K> at = linearised(z);
      record.nu = z.residual(at.z_hat);
      unroll<0, M>([&](auto m) __attribute__((always_inline)) {
        unroll<0, kErrors>([&](auto n) __attribute__((always_inline)) {
          cross(int{n}, int{m}) = row_times<Measurement, m>(
              at.h, [&](auto k) __attribute__((always_inline)) { return p(n, kState(k)); });
        });
      });
      unroll<0, M>([&](auto c) __attribute__((always_inline)) {
        unroll<0, c + 1>([&](auto r) __attribute__((always_inline)) {
          record.s(r, c) = row_times<Measurement, r>(
              at.h, [&](auto k) __attribute__((always_inline)) { return cross(kState(k), int{c}); });
        });
        record.s(c, c) += noise(int{c});
      });
    }
    bool sharp = false;
    if constexpr (kGuard == Guard::kConditioned)
      for (int m = 0; m < M; ++m) sharp = sharp || !(noise(m) > kSharp * record.s(m, m));
    return sharp;
  }
  template <class Measurement>
  [[gnu::always_inline]] auto linearised(const Measurement& z) const {
    if constexpr (requires { z.linearised(x); }) {
      return z.linearised(x);
    } else {
      return Linearised<Scalar, Measurement::kDimension, static_cast<int>(Measurement::kTouches.size())>{
          .z_hat = z.predict(x), .h = z.jacobian(x)};
    }
  }

  template <class Measurement>
  static constexpr Coefficient coefficient(int m, int k) {
    if constexpr (requires { Measurement::kShape; }) {
      return Measurement::kShape[static_cast<std::size_t>(m) * Measurement::kTouches.size() +
                                 static_cast<std::size_t>(k)];
    } else {
      return Coefficient::kValue;
    }
  }
  /// Row m of H times a column, whose entry k is column(k).
  template <class Measurement, int m, class H, class Column>
  [[gnu::always_inline]] static Scalar row_times(const H& h, const Column& column) {
    constexpr int K = static_cast<int>(Measurement::kTouches.size());
    constexpr int kFirst = [] {
      int k = 0;
      while (k < K - 1 && coefficient<Measurement>(m, k) == Coefficient::kZero) ++k;
      return k;
    }();
    constexpr Coefficient kBegin = coefficient<Measurement>(m, kFirst);
    const Scalar begin = column(std::integral_constant<int, kFirst>{});
    Scalar sum = kBegin == Coefficient::kOne        ? begin
                 : kBegin == Coefficient::kMinusOne ? -begin
                 : kBegin == Coefficient::kValue    ? h(m, kFirst) * begin
                                                    : Scalar{0};
    unroll<kFirst + 1, K>([&](auto k) __attribute__((always_inline)) {
      constexpr Coefficient kKind = coefficient<Measurement>(m, k);
      if constexpr (kKind == Coefficient::kValue) sum = base::add_product(sum, Scalar{h(m, int{k})}, Scalar{column(k)});
      if constexpr (kKind == Coefficient::kOne) sum += column(k);
      if constexpr (kKind == Coefficient::kMinusOne) sum -= column(k);
    });
    return sum;
  }
};

}  // namespace tetap::filter
