// SPDX-License-Identifier: Apache-2.0
// Models with their structure declared by types: constant velocity in the plane, and the unicycle of euler_pose.hpp.
// Equal to the dense models, entry by entry.
#pragma once

#include "support/euler_pose.hpp"
#include "tetap/filter/structure.hpp"

namespace tetap::test {

/// State (x, vx, y, vy), white acceleration constant within a step.
struct StructuredVelocity {
  using State = filter::VectorState<float, 4>;
  using F = filter::UnitPlus<float, 4, filter::Entry{0, 1}, filter::Entry{2, 3}>;
  using Q = filter::SparseSymmetric<float, 4, filter::Entry{0, 0}, filter::Entry{0, 1}, filter::Entry{1, 1},
                                    filter::Entry{2, 2}, filter::Entry{2, 3}, filter::Entry{3, 3}>;
  float dt_s = 0;
  float acceleration_variance = 0;

  [[nodiscard]] State predict(const State& x) const {
    State next = x;
    next.value(0) += dt_s * x.value(1);
    next.value(2) += dt_s * x.value(3);
    return next;
  }
  [[nodiscard]] F jacobian(const State&) const { return {{dt_s, dt_s}}; }
  [[nodiscard]] Q noise(const State&) const {
    const float dt2 = dt_s * dt_s;
    const float position = acceleration_variance * dt2 * dt2 * 0.25F;
    const float both = acceleration_variance * dt2 * dt_s * 0.5F;
    const float velocity = acceleration_variance * dt2;
    return {{position, both, velocity, position, both, velocity}};
  }
};

struct StructuredUnicycle {
  using State = filter::VectorState<float, 3>;
  using F = filter::UnitPlus<float, 3, filter::Entry{0, 2}, filter::Entry{1, 2}>;
  using Q = filter::SparseSymmetric<float, 3, filter::Entry{0, 0}, filter::Entry{1, 1}, filter::Entry{2, 2}>;
  struct Step {
    State x;
    F f;
    Q q;
  };
  EulerUnicycle<float> motion;

  [[nodiscard]] Step step(const State& from) const {
    const base::SinCos heading = base::sincos(from.value(2));
    const float mx = motion.ds_m * heading.cos;
    const float my = motion.ds_m * heading.sin;
    return {.x = {{from.value(0) + mx, from.value(1) + my, from.value(2) + motion.dyaw_rad}},
            .f = {{-my, mx}},
            .q = {motion.variance}};
  }
};

struct StructuredSight {
  using State = filter::VectorState<float, 3>;
  static constexpr int kDimension = 2;
  static constexpr std::array<int, 3> kTouches{0, 1, 2};
  static constexpr std::array<filter::Coefficient, 6> kShape{
      filter::Coefficient::kValue, filter::Coefficient::kValue, filter::Coefficient::kZero,
      filter::Coefficient::kValue, filter::Coefficient::kValue, filter::Coefficient::kMinusOne};
  EulerSight<float> sight;

  [[nodiscard]] filter::Vector<float, 2> predict(const State& at) const { return linearised(at).z_hat; }
  [[nodiscard]] filter::Vector<float, 2> residual(const filter::Vector<float, 2>& z_hat) const {
    return sight.residual(z_hat);
  }
  [[nodiscard]] filter::Vector<float, 2> noise() const { return sight.variance; }
  [[nodiscard]] filter::Linearised<float, 2, 3> linearised(const State& at) const {
    const auto line = sight.observe(at);
    const float inverse = 1.0F / line.range_m;
    const float cx = line.dx_m * inverse;
    const float cy = line.dy_m * inverse;
    filter::Linearised<float, 2, 3> out;
    out.z_hat = sight.value(line);
    out.h(0, 0) = -cx;
    out.h(0, 1) = -cy;
    out.h(0, 2) = 0.0F;
    out.h(1, 0) = cy * inverse;
    out.h(1, 1) = -cx * inverse;
    out.h(1, 2) = -1.0F;
    return out;
  }
};

}  // namespace tetap::test
