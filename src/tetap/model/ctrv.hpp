// SPDX-License-Identifier: Apache-2.0
// Constant turn rate and velocity: a target on circular arcs. Source: Schubert, Richter, Wanielik 2008, "Comparison and
// evaluation of advanced motion models for vehicle tracking"; Bar-Shalom, Li, Kirubarajan 2001, sec. 11.7.
#pragma once

#include "tetap/filter/sigma_points.hpp"
#include "tetap/filter/wrap.hpp"

#include <array>

namespace tetap::model {

/// (x m, y m, speed m/s along yaw, yaw rad, yaw rate rad/s); yaw is wrapped.
template <class Scalar_>
struct CtrvState {
  using Scalar = Scalar_;
  static constexpr int kErrors = 5, kAngle = 3;
  filter::Vector<Scalar, 5> value = filter::Vector<Scalar, 5>::Zero();

  [[nodiscard]] CtrvState plus(const filter::Vector<Scalar, 5>& dx) const {
    CtrvState moved{value + dx};
    moved.value(3) = filter::wrapped(moved.value(3));
    return moved;
  }
  [[nodiscard]] filter::Vector<Scalar, 5> minus(const CtrvState& other) const {
    filter::Vector<Scalar, 5> d = value - other.value;
    d(3) = filter::wrapped(d(3));
    return d;
  }
  [[nodiscard]] bool finite() const { return filter::VectorState<Scalar, 5>{value}.finite(); }
};

/// Accelerations along the path and of the yaw are constant within a step, and enter as noise w = (m/s^2, rad/s^2).
/// predict(x, w) is for augmented filters; jacobian() and the Q that it forms are for the others.
template <class Scalar>
struct Ctrv {
  using State = CtrvState<Scalar>;
  static constexpr int kNoises = 2;
  static constexpr std::array<int, 3> kNonlinear{2, 3, 4};

  Scalar dt_s = 0;
  Scalar acceleration_variance = 0;      ///< (m/s^2)^2
  Scalar yaw_acceleration_variance = 0;  ///< (rad/s^2)^2

  [[nodiscard]] filter::Vector<Scalar, 2> noise() const { return {acceleration_variance, yaw_acceleration_variance}; }

  [[nodiscard]] State predict(const State& x) const { return predict(x, filter::Vector<Scalar, 2>::Zero()); }
  [[nodiscard]] State predict(const State& x, const filter::Vector<Scalar, 2>& w) const {
    const Arc arc(x, dt_s);
    const auto heading = base::sincos(x.value(3));
    const Scalar half = Scalar(0.5F) * dt_s * dt_s;
    State next = x;
    next.value(0) += x.value(2) * dt_s * arc.ratio * arc.cosine + half * w(0) * heading.cos;
    next.value(1) += x.value(2) * dt_s * arc.ratio * arc.sine + half * w(0) * heading.sin;
    next.value(2) += dt_s * w(0);
    next.value(3) = filter::wrapped(x.value(3) + dt_s * x.value(4) + half * w(1));
    next.value(4) += dt_s * w(1);
    return next;
  }
  /// By how much yaw turns more at x + dx than at x, or by the noise.
  [[nodiscard]] Scalar turn(const filter::Vector<Scalar, 5>& dx) const { return dx(3) + dt_s * dx(4); }
  [[nodiscard]] Scalar noise_turn(const filter::Vector<Scalar, 2>& w) const {
    return Scalar(0.5F) * dt_s * dt_s * w(1);
  }
  [[nodiscard]] filter::Matrix<Scalar, 5, 5> jacobian(const State& x) const {
    const Arc arc(x, dt_s);
    const Scalar length = x.value(2) * dt_s;
    const Scalar half = Scalar(0.5F) * dt_s;
    filter::Matrix<Scalar, 5, 5> f = filter::Matrix<Scalar, 5, 5>::Identity();
    f(0, 2) = dt_s * arc.ratio * arc.cosine;
    f(1, 2) = dt_s * arc.ratio * arc.sine;
    f(0, 3) = -length * arc.ratio * arc.sine;
    f(1, 3) = length * arc.ratio * arc.cosine;
    f(0, 4) = length * half * (arc.slope * arc.cosine - arc.ratio * arc.sine);
    f(1, 4) = length * half * (arc.slope * arc.sine + arc.ratio * arc.cosine);
    f(3, 4) = dt_s;
    return f;
  }
  /// G diag(variances) G^T, G = d predict / d w.
  [[nodiscard]] filter::Symmetric<Scalar, 5> noise(const State& x) const {
    const auto heading = base::sincos(x.value(3));
    const Scalar half = Scalar(0.5F) * dt_s * dt_s;
    const filter::Vector<Scalar, 5> along{half * heading.cos, half * heading.sin, dt_s, Scalar{0}, Scalar{0}};
    const filter::Vector<Scalar, 5> turn{Scalar{0}, Scalar{0}, Scalar{0}, half, dt_s};
    filter::Symmetric<Scalar, 5> q;
    for (int c = 0; c < 5; ++c)
      for (int r = 0; r <= c; ++r)
        q(r, c) = acceleration_variance * along(r) * along(c) + yaw_acceleration_variance * turn(r) * turn(c);
    return q;
  }

 private:
  /// The chord of the arc: its direction, its length over the arc's, sin(h)/h for half the turn h, and the slope of
  /// that by h.
  struct Arc {
    Scalar cosine, sine, ratio, slope;
    Arc(const State& x, Scalar dt_s) {
      const Scalar h = Scalar(0.5F) * x.value(4) * dt_s;
      const auto direction = base::sincos(x.value(3) + h);
      cosine = direction.cos;
      sine = direction.sin;
      const Scalar h2 = h * h;
      if (h2 < Scalar(0.01F)) {  // the next terms are h^10/11! and h^9/9!/11: below double's rounding
        ratio = Scalar{1} -
                h2 / Scalar{6} *
                    (Scalar{1} - h2 / Scalar{20} * (Scalar{1} - h2 / Scalar{42} * (Scalar{1} - h2 / Scalar{72})));
        slope = -h / Scalar{3} *
                (Scalar{1} - h2 / Scalar{10} * (Scalar{1} - h2 / Scalar{28} * (Scalar{1} - h2 / Scalar{54})));
      } else {
        const auto turned = base::sincos(h);
        ratio = turned.sin / h;
        slope = (turned.cos - ratio) / h;
      }
    }
  };
};

}  // namespace tetap::model
