// SPDX-License-Identifier: Apache-2.0
// Models of the common scenario in two sizes. The small one is the unicycle of support/euler_pose.hpp with three
// states. The large one has the errors of odometry (its scale, the drift of its heading a step) as a fourth and a
// fifth.
#pragma once

#include "costs/scenario.hpp"
#include "support/structured_models.hpp"

namespace tetap::costs {

/// Variance that is added in each step: odometry's, the path's shared by both axes.
inline constexpr std::array<float, 3> kVariance{0.5F * kSigmaDs_m * kSigmaDs_m, 0.5F * kSigmaDs_m* kSigmaDs_m,
                                                kSigmaDyaw_rad* kSigmaDyaw_rad};

/// State (x, y, yaw, scale error, heading drift): the motion with two errors of odometry that hardly change.
struct ScaledUnicycle {
  using State = filter::VectorState<float, 5>;
  static constexpr std::array<int, 2> kNonlinear{2, 3};
  float ds_m = 0, dyaw_rad = 0;

  [[nodiscard]] State predict(const State& from) const {
    const base::SinCos heading = base::sincos(from.value(2));
    const float ds = ds_m * (1.0F + from.value(3));
    State next = from;
    next.value(0) += ds * heading.cos;
    next.value(1) += ds * heading.sin;
    next.value(2) += dyaw_rad + from.value(4);
    return next;
  }
  [[nodiscard]] filter::Matrix<float, 5, 5> jacobian(const State& from) const {
    const base::SinCos heading = base::sincos(from.value(2));
    const float ds = ds_m * (1.0F + from.value(3));
    filter::Matrix<float, 5, 5> f = filter::Matrix<float, 5, 5>::Identity();
    f(0, 2) = -ds * heading.sin;
    f(1, 2) = ds * heading.cos;
    f(0, 3) = ds_m * heading.cos;
    f(1, 3) = ds_m * heading.sin;
    f(2, 4) = 1.0F;
    return f;
  }
  [[nodiscard]] filter::Symmetric<float, 5> noise(const State&) const {
    return filter::Symmetric<float, 5>::diagonal({kVariance[0], kVariance[1], kVariance[2], 1e-8F, 1e-10F});
  }
};

/// Range and bearing of a state whose first three numbers are the pose.
template <int N>
struct Sight {
  using State = filter::VectorState<float, N>;
  static constexpr int kDimension = 2;
  static constexpr std::array<int, 3> kTouches{0, 1, 2};
  static constexpr auto kNonlinear = test::EulerSight<float>::kNonlinear;
  static constexpr auto kLinear = test::EulerSight<float>::kLinear;
  static constexpr auto kAngles = test::EulerSight<float>::kAngles;
  static constexpr auto kShape = test::StructuredSight::kShape;
  test::EulerSight<float> sight;

  [[nodiscard]] static filter::VectorState<float, 3> pose(const State& at) {
    return {filter::Vector<float, 3>(at.value(0), at.value(1), at.value(2))};
  }
  [[nodiscard]] auto observe(const State& at) const { return sight.observe(pose(at)); }
  [[nodiscard]] filter::Vector<float, 2> value(const test::EulerSight<float>::Line& to) const {
    return sight.value(to);
  }
  [[nodiscard]] filter::Vector<float, 2> difference(const test::EulerSight<float>::Line& to,
                                                    const test::EulerSight<float>::Line& from) const {
    return sight.difference(to, from);
  }
  [[nodiscard]] filter::Vector<float, 2> predict(const State& at) const { return sight.predict(pose(at)); }
  [[nodiscard]] filter::Vector<float, 2> residual(const filter::Vector<float, 2>& z_hat) const {
    return sight.residual(z_hat);
  }
  [[nodiscard]] filter::Vector<float, 2> noise() const { return sight.variance; }
  [[nodiscard]] filter::Matrix<float, 2, 1> slopes() const { return sight.slopes(); }
  [[nodiscard]] filter::Matrix<float, 2, 3> jacobian(const State& at) const { return sight.jacobian(pose(at)); }
  [[nodiscard]] filter::Linearised<float, 2, 3> linearised(const State& at) const {
    return test::StructuredSight{sight}.linearised(pose(at));
  }
};

}  // namespace tetap::costs
